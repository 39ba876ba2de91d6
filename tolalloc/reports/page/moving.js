// Moving pictures of a report, each drawn from the record that stands beside it.

for (const record of document.querySelectorAll("script.moving")) {
  const { scene, shares } = JSON.parse(record.textContent);
  const mechanism = new Mechanism(record.parentElement.querySelector("div"), scene);
  mechanism.shade(shares);
  follow(mechanism);
}
