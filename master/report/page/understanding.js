"use strict";
// Of a run: how good evaluations were over two of the parameters.

const CONTOUR_CELLS = 32;
const CONTOUR_WIDTH = 0.05;  // s.d. of the kernel, share of a range
const CONTOUR_STEPS = 8;
const CONTOUR_LEAST = 0.3;   // evaluations, weighed by the kernel, below which nothing is known

// Of each evaluation the share of the others that are worse, in the fitness or an objective.
function standings(evaluated, value, higher) {
  const order = evaluated.map((one, i) => [value(one), i]).sort((a, b) => (higher ? a[0] - b[0] : b[0] - a[0]));
  const share = new Array(order.length);
  order.forEach(([, i], k) => { share[i] = order.length > 1 ? k / (order.length - 1) : 1; });
  return share;
}

// Cells [x0, y0, x1, y1, standing] in shares of the ranges: a kernel's mean (Nadaraya 1964), in
// steps, where anything was evaluated near.
function contourCells(evaluated, share, gx, gy) {
  const cells = [];
  const at = (k) => (k + 0.5) / CONTOUR_CELLS;
  const weights = (g, k) => evaluated.map((one) => Math.exp(-0.5 * ((one[2][g] - at(k)) / CONTOUR_WIDTH) ** 2));
  const columns = Array.from({ length: CONTOUR_CELLS }, (_, k) => weights(gx, k));
  const rows = Array.from({ length: CONTOUR_CELLS }, (_, k) => weights(gy, k));
  columns.forEach((a, i) => rows.forEach((b, j) => {
    let [sum, mean] = [0, 0];
    a.forEach((w, n) => {
      sum += w * b[n];
      mean += w * b[n] * share[n];
    });
    if (sum < CONTOUR_LEAST) return;
    const step = Math.min(CONTOUR_STEPS, 1 + Math.floor((CONTOUR_STEPS * mean) / sum)) / CONTOUR_STEPS;
    cells.push([i / CONTOUR_CELLS, j / CONTOUR_CELLS, (i + 1) / CONTOUR_CELLS, (j + 1) / CONTOUR_CELLS, step]);
  }));
  return cells;
}

function geneValue({ lower, upper, log }, share) {
  return log ? lower * (upper / lower) ** share : lower + share * (upper - lower);
}

function startUnderstanding() {
  const parent = document.getElementById("contour-plot");
  const genes = PAGE.sample?.genes || [];
  if (!parent || genes.length < 2) return;
  const controls = document.getElementById("contour-controls");
  const outputs = PAGE.front?.objectives.length
    ? PAGE.front.objectives.map(({ name, maximise }, m) => ({ name, higher: maximise, of: (one) => one[3][m] }))
    : [{ name: PAGE.fitness.name, higher: PAGE.fitness.higher_is_better, of: (one) => one[1] }];
  const most = genes.map((gene, g) => [Math.max(...gene.importance), g]).sort((a, b) => b[0] - a[0]).map(([, g]) => [String(g), genes[g].key]);
  const across = choice(controls, "Across", most, draw, "contour_across");
  const up = choice(controls, "Up", [most[1], ...most.filter((_, k) => k !== 1)], draw, "contour_up");
  const output = outputs.length < 2 ? () => 0 : choice(controls, "Of", outputs.map(({ name }, m) => [String(m), name]), draw, "contour_of");
  const chart = new Chart(parent, 0.6, true);

  function draw(keep) {
    const { evaluated, genes: now } = PAGE.sample;
    const [gx, gy, { name, higher, of }] = [Number(across()), Number(up()), outputs[Number(output())]];
    const share = standings(evaluated, of, higher);
    const best = evaluated[share.indexOf(Math.max(...share))];
    const axis = (g) => ({
      min: 0, max: 1, label: withUnit(now[g].key, now[g].unit),
      ticks: [0, 0.25, 0.5, 0.75, 1].map((s) => [s, numberText(geneValue(now[g], s), 3)]),
    });
    const mark = (one) => [one[2][gx], one[2][gy], one];
    chart.show({
      x: axis(gx), y: axis(gy),
      layers: [
        { kind: "cells", style: "final", name: "share that is worse", cells: contourCells(evaluated, share, gx, gy) },
        { kind: "points", style: "quiet", shape: "dot", faint: 0.35, name: "evaluated", points: evaluated.filter((one) => one !== best).map(mark) },
        { kind: "points", style: "tuned", shape: "diamond", name: "best", points: [mark(best)] },
      ],
      describe: (one) => `genome ${one[0]}: ${name} ${numberText(of(one), 6)}, ${[gx, gy].map((g) => `${now[g].key} ${numberText(geneValue(now[g], one[2][g]), 4)}`).join(", ")}`,
    }, `${name} over ${now[gx].key} and ${now[gy].key}`,
    `The darker, the better the evaluations near, by their order; blank where there were none. Orange: the best of ${evaluated.length}.`, keep);
  }
  drawLive(draw);
}
