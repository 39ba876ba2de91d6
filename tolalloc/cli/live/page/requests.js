// What the page asks of its server; where that does not answer the page says so, waits, and goes on.

const AGAIN = 1000; // ms between two tries while the server is away
const token = new URLSearchParams(location.search).get("token");
const tab = crypto.randomUUID();
const place = () => document.getElementById("trouble");
let away = false;

// The server refused a request, in one sentence.
export class Refusal extends Error {}

// A refusal is said at the top of the page, unless it is silent because a row says it.
export async function ask(name, record = {}, silent = false) {
  for (;;) {
    let answer, found;
    try {
      answer = await fetch(`/api/${name}`, { method: "POST", headers: { "Content-Type": "application/json", "X-Token": token }, body: JSON.stringify({ tab, ...record }) });
      found = await answer.json();
    } catch {
      away = true;
      document.body.classList.add("away");
      trouble("The server does not answer. Start tolalloc open again on the same study: the page then goes on with this design.");
      await new Promise((done) => setTimeout(done, AGAIN));
      continue;
    }
    if (away) {
      away = false;
      document.body.classList.remove("away");
      trouble("");
    }
    if (answer.ok) return found;
    if (!silent) trouble(found.error);
    throw new Refusal(found.error);
  }
}

// What a request answers; nothing where it was refused, which the page has said.
export async function refusable(asked) {
  try {
    return await asked;
  } catch (error) {
    if (!(error instanceof Refusal)) throw error;
    return null;
  }
}

export function trouble(sentence) {
  if (away && !sentence) return; // what is still away is still said
  place().hidden = !sentence;
  place().textContent = sentence;
}
