"use strict";
// Drives that stray where nobody knows why: which they probably are, where and when they were
// driven.

const STRAYED = 0.5;  // a chance from which a drive is drawn as one of them

function strayMap(drives) {
  const arrows = (some) => some.map((d) => [d.start.x, d.start.y, d.end.x, d.end.y, d.trial]);
  const span = (k) => robustLimits(drives.flatMap((d) => [d.start[k], d.end[k]]), [], 0.08);
  const [astray, others] = [drives.filter((d) => d.chance >= STRAYED), drives.filter((d) => d.chance < STRAYED)];
  return {
    spec: { x: { ...span("x"), label: "x of the world, m" }, y: { ...span("y"), label: "y of the world, m" }, equal: true,
            layers: [{ kind: "arrows", style: "scale-0", width: 1, faint: 0.5, arrows: arrows(others), name: "drive" },
                     { kind: "arrows", style: "scale-4", width: 2.2, arrows: arrows(astray), name: "probably strayed" }],
            describe: describeTrial, picked: showDrive },
    title: "Drives that strayed",
    note: `${astray.length} of ${drives.length} drives probably strayed; from start to measured end.`,
  };
}

function strayTimes(drives) {
  const points = drives.map((d) => [d.trial.session_time_s / 60, 100 * d.chance, d.trial]);
  return {
    spec: { x: { ...robustLimits(points.map((p) => p[0]), [], 0.04), label: "time in the session, min" },
            y: { min: -4, max: 104, label: "chance, %" },
            layers: [{ kind: "points", shape: "dot", style: "final", points, name: "drive" }],
            describe: describeTrial, picked: showDrive },
    title: "Chance that a drive strayed",
    note: "A few minutes with many of them, or one place, tell where to look for the cause.",
  };
}

function startStrays(trials) {
  const parent = document.getElementById("stray-plots");
  if (!parent) return;
  const { chances } = PAGE.residual.strays;
  const drives = trials.map((trial, i) => ({ ...floorTrial(trial), chance: chances[i] })).filter((d) => isNumber(d.chance));
  for (const { spec, title, note } of [strayMap(drives), strayTimes(drives)]) {
    const panel = new Chart(parent, 0.8);
    panel.figure.classList.toggle("large", Boolean(spec.equal));
    panel.show(spec, title, note);
  }
}
