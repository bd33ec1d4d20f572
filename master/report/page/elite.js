"use strict";
// Of a run: the best of the last generation across all genes, as parallel coordinates.

function startElite() {
  const parent = document.getElementById("elite-plot");
  if (!parent || !PAGE.elite?.lines.length) return;
  const chart = new Chart(parent, 0.5, true);

  function draw(keep) {
    const { axes, lines } = PAGE.elite;
    if (!lines.length) return;
    const row = (i) => axes.length - 1 - i;  // the first at the top
    chart.aspect = Math.max(0.3, 0.055 * axes.length + 0.08);
    const layers = axes.map((axis, i) => ({ kind: "line", style: "grid", width: 2, name: axis.key, points: [[0, row(i)], [1, row(i)]] }));
    // The best is drawn last, over the others.
    [...lines.entries()].reverse().forEach(([k, line]) => {
      const points = line.shares.map((share, i) => [share, row(i), { line, i, k }]);
      const look = k === 0 ? { style: "tuned", width: 2.6 } : { style: "final", width: 1.3, faint: 0.35 };
      layers.push({ kind: "line", ...look, name: `genome ${line.birth_id}`, points });
      layers.push({ kind: "points", style: look.style, shape: "dot", faint: k === 0 ? 1 : 0.4, name: `genome ${line.birth_id}`, points });
    });
    chart.show({
      x: { min: -0.02, max: 1.02, label: "of the range as it is searched", ticks: [[0, "least"], [0.5, "middle"], [1, "greatest"]] },
      y: { min: -0.6, max: axes.length - 0.4, label: "", room: Math.min(170, 14 + 6.6 * Math.max(...axes.map(({ key }) => key.length))),
        ticks: axes.map(({ key }, i) => [row(i), key.length > 24 ? `${key.slice(0, 23)}…` : key]) },
      layers,
      describe: ({ line, i, k }) => {
        const { key, unit, lower, upper } = axes[i];
        const fitness = withUnit(numberText(line.fitness, 6), PAGE.fitness.unit, " ");
        return `${k === 0 ? "The best, genome" : "Genome"} ${line.birth_id}, ${fitness}: ${key} ${withUnit(line.values[i], unit, " ")}, of ${lower} to ${upper}`;
      },
    }, `The best ${lines.length} of the last generation`, `Orange and bold: the best. The ends of a row are the ends of what was searched.`, keep);
  }
  drawLive(draw);
}
