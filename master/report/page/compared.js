"use strict";
// Runs beside each other: their best fitness, in one plot.

function startCompared() {
  const parent = document.getElementById("compared-plot");
  if (!parent || !PAGE.compared?.length) return;
  const controls = document.getElementById("compared-controls");
  const chart = new Chart(parent, 0.45, true);
  const against = choice(controls, "Against", AGAINST.map((a) => [a.key, a.label]), draw, "against");
  const key = element(controls, "ul", { className: "key", ariaLabel: "Key" });
  function draw(keep) {
    const { of, label } = AGAINST.find((a) => a.key === against());
    const lines = PAGE.compared.map(({ name, generations }) => (
      generations.filter((g) => isNumber(g.best)).map((g) => [of(g), g.best, { name, g }])));
    fillKey(key, PAGE.compared.map(({ name }) => name));
    const points = lines.flat();
    if (!points.length) return;
    const [from, to] = extent(points.map((p) => p[0]));
    // A bad first generation would leave no room for what matters.
    const ys = robustLimits(points.map((p) => p[1]), lines.map((line) => line.at(-1)?.[1]));
    chart.show({
      x: { min: from, max: Math.max(to, from + 1), label },
      y: { ...ys, label: withUnit(`best ${PAGE.fitness.name}`, PAGE.fitness.unit) },
      layers: lines.flatMap((line, i) => readLine({ ...lineLook(i), name: PAGE.compared[i].name }, line)),
      describe: ({ name, g }) => `${name}, generation ${g.generation}: best ${numberText(g.best, 6)}`,
    }, `Best ${PAGE.fitness.name} by ${label}`, `${PAGE.fitness.higher_is_better ? "Higher" : "Lower"} is better.`, keep);
  }
  drawLive(draw);
}
