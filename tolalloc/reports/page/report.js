// A report's own script: every figure is drawn from the record that stands beside it, for paper at the paper's width.

const PAPER = 680, HALF = 330; // A4 and Letter within their margins, and one of two beside each other [px]
const charts = [...document.querySelectorAll("script.figure")].map(
  (record) => new Chart(record.parentElement.querySelector("div"), JSON.parse(record.textContent)),
);
addEventListener("beforeprint", () => charts.forEach((own) => own.print(own.element.closest(".beside") ? HALF : PAPER)));
addEventListener("afterprint", () => charts.forEach((own) => own.show()));
