"use strict";
// Runs beside each other: their best fitness, in one plot.

function startCompared() {
  const parent = document.getElementById("compared-plot");
  if (!parent || !PAGE.compared?.length) return;
  const controls = document.getElementById("compared-controls");
  const chart = new Chart(parent, 0.45, true);
  const against = choice(controls, "Against", AGAINST.map((a) => [a.key, a.label]), draw, "against");
  const key = controls.appendChild(document.createElement("ul"));
  key.className = "key";
  key.setAttribute("aria-label", "Key");
  function draw(keep) {
    const { of, label } = AGAINST.find((a) => a.key === against());
    const style = (i) => LINE_STYLES[i % LINE_STYLES.length];
    const lines = PAGE.compared.map(({ name, generations }, i) => ({
      name, style: style(i), dashed: i % 2 === 1, points: generations.filter((g) => isNumber(g.best)).map((g) => [of(g), g.best, { name, g }]) }));
    key.replaceChildren(...lines.map(({ name, style: its, dashed }) => lineKey(name, its, dashed)));
    const points = lines.flatMap((line) => line.points);
    if (!points.length) return;
    const xs = points.map((p) => p[0]);
    // A bad first generation would leave no room for what matters.
    const ys = robustLimits(points.map((p) => p[1]), lines.map((line) => line.points.at(-1)?.[1]));
    const unit = PAGE.fitness.unit && PAGE.fitness.unit !== "-" ? `, ${PAGE.fitness.unit}` : "";
    chart.show({
      x: { min: Math.min(...xs), max: Math.max(Math.max(...xs), Math.min(...xs) + 1), label },
      y: { ...ys, label: `best ${PAGE.fitness.name}${unit}` },
      layers: lines.flatMap(({ points: all, ...line }) => [
        { kind: "line", ...line, width: 2, points: all.map(([x, y]) => [x, y]) },
        { kind: "points", style: line.style, shape: "dot", faint: 0.01, name: line.name, points: all },
      ]),
      describe: ({ name, g }) => `${name}, generation ${g.generation}: best ${numberText(g.best, 6)}`,
    }, `Best ${PAGE.fitness.name} by ${label}`, `${PAGE.fitness.higher_is_better ? "Higher" : "Lower"} is better.`, keep);
  }
  drawLive(draw);
}
