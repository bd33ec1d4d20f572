"use strict";
// Of a run: how often operators were drawn, and where the population's genes were.

const LINE_STYLES = ["final", "tuned", "place", "scale-2", "scale-3", "quiet", "scale-4", "scale-1"];

// Eight lines can be distinguished, by colour and by dashes; the rest has no name of its own.
const lineLook = (i) => ({ style: LINE_STYLES[i % LINE_STYLES.length], dashed: i % 2 === 1 });

function fillKey(key, names) {
  key.replaceChildren();
  names.forEach((name, i) => {
    const { style, dashed } = lineLook(i);
    const item = element(key, "li");
    const svg = svgElement(item, "svg", { class: "mark", "aria-hidden": "true" });
    svgElement(svg, "path", { d: "M1 10h18", stroke: `var(--${style})`, "stroke-dasharray": dashed ? "4 3" : "none" });
    item.append(name);
  });
}

// A line through `points`, each of which can be pointed at.
const readLine = (line, points) => [
  { kind: "line", width: 2, ...line, points },
  { kind: "points", shape: "dot", faint: 0.01, style: line.style, name: line.name, points },
];

function startOperators() {
  const parent = document.getElementById("operator-plot");
  if (!parent || !PAGE.operators?.names.length) return;
  const chart = new Chart(parent, 0.4, true);
  const key = document.getElementById("operator-key");
  function draw(keep) {
    const { names, generations, probabilities } = PAGE.operators;
    if (!generations.length) return;
    fillKey(key, names);
    const most = Math.max(...probabilities.flat().filter(isNumber), 0.01);
    chart.show({
      x: { min: generations[0], max: Math.max(generations.at(-1), generations[0] + 1), label: "generation" },
      y: { min: 0, max: 105 * most, label: "probability, %" },
      layers: names.flatMap((name, i) => readLine({ ...lineLook(i), name },
        generations.map((g, k) => [g, 100 * probabilities[k][i], { g, name, p: probabilities[k][i] }]))),
      describe: ({ g, name, p }) => `generation ${g}: ${name} ${numberText(100 * p, 3)} %`,
    }, "Probability of each operator", "", keep);
  }
  drawLive(draw);
}

// Ranges of several decades are searched by their logarithm.
const spansDecades = (edges) => edges[0] > 0 && edges.at(-1) / edges[0] > 30;

function drawGene(chart, gene, keep) {
  const { key, unit, edges, generations, counts, best } = gene;
  const to = (k) => (k + 1 < generations.length ? generations[k + 1] : 2 * generations[k] - (generations[k - 1] ?? generations[k] - 1));
  const cells = [];
  counts.forEach((bins, k) => {
    const all = bins.reduce((a, b) => a + b, 0);
    bins.forEach((n, i) => n && cells.push([generations[k], edges[i], to(k), edges[i + 1], Math.sqrt(n / all)]));
  });
  const log = spansDecades(edges);
  const room = log ? 0 : 0.03 * (edges.at(-1) - edges[0]);
  const share = (best.at(-1) - edges[0]) / (edges.at(-1) - edges[0]);
  const atEnd = share < 0.001 || share > 0.999;
  const middle = generations.map((g, k) => (g + to(k)) / 2);
  chart.show({
    x: { min: generations[0], max: Math.max(to(generations.length - 1), generations[0] + 1), label: "generation" },
    y: { min: log ? edges[0] / 1.1 : edges[0] - room, max: log ? edges.at(-1) * 1.1 : edges.at(-1) + room, log, label: withUnit(key, unit) },
    layers: [
      { kind: "cells", style: "final", cells, name: "share of the population" },
      ...readLine({ style: "tuned", name: "best" }, best.map((v, k) => [middle[k], v, { g: generations[k], v }])),
      ...[edges[0], edges.at(-1)].map((v) => ({ kind: "line", style: "quiet", dashed: true, name: "end of the range", points: [[generations[0], v], [to(generations.length - 1), v]] })),
    ],
    describe: ({ g, v }) => `generation ${g}: best ${withUnit(numberText(v, 5), unit, " ")}`,
  }, key, atEnd ? "▲ The best lies at an end of the range: widen it in [genes]." : "", keep);
}

function startGenes() {
  const parent = document.getElementById("gene-plots");
  if (!parent) return;
  const charts = new Map();
  const draw = (keep) => (PAGE.genes || []).forEach((gene) => {
    if (!charts.has(gene.key)) charts.set(gene.key, new Chart(parent, 0.7));
    drawGene(charts.get(gene.key), gene, keep);
  });
  drawLive(draw);
}
