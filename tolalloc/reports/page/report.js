// A report's own script: every figure is drawn from the record that stands beside it.

for (const record of document.querySelectorAll("script.figure"))
  new Chart(record.parentElement.querySelector("div"), JSON.parse(record.textContent));
