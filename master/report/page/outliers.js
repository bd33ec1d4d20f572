"use strict";
// Outlier drives where nobody knows why: which they probably are, where and when they were
// driven.

const OUTLIER_CHANCE = 0.5;  // a chance from which a drive is drawn as one of them

function outlierMap(drives) {
  const arrows = (some) => some.map((d) => [d.start.x, d.start.y, d.end.x, d.end.y, d.trial]);
  const span = (k) => robustLimits(drives.flatMap((d) => [d.start[k], d.end[k]]), [], 0.08);
  const [outlierDrives, others] = [drives.filter((d) => d.chance >= OUTLIER_CHANCE), drives.filter((d) => d.chance < OUTLIER_CHANCE)];
  return {
    spec: { x: { ...span("x"), label: "x of the world, m" }, y: { ...span("y"), label: "y of the world, m" }, equal: true,
            layers: [{ kind: "arrows", style: "scale-0", width: 1, faint: 0.5, arrows: arrows(others), name: "drive" },
                     { kind: "arrows", style: "scale-4", width: 2.2, arrows: arrows(outlierDrives), name: "probable outlier" }],
            describe: describeTrial, picked: showDrive },
    title: "Outlier drives",
    note: `${outlierDrives.length} of ${drives.length} drives are probable outliers; from start to measured end.`,
  };
}

function outlierTimes(drives) {
  const points = drives.map((d) => [d.trial.session_time_s / 60, 100 * d.chance, d.trial]);
  return {
    spec: { x: { ...robustLimits(points.map((p) => p[0]), [], 0.04), label: "time in the session, min" },
            y: { min: -4, max: 104, label: "chance, %" },
            layers: [{ kind: "points", shape: "dot", style: "final", points, name: "drive" }],
            describe: describeTrial, picked: showDrive },
    title: "Chance that a drive is an outlier",
    note: "A few minutes with many of them, or one place, show where to look for the cause.",
  };
}

function startOutliers(trials) {
  const parent = document.getElementById("outlier-plots");
  if (!parent) return;
  const { chances } = PAGE.residual.strays;
  const drives = trials.map((trial, i) => ({ ...floorTrial(trial), chance: chances[i] })).filter((d) => isNumber(d.chance));
  for (const { spec, title, note } of [outlierMap(drives), outlierTimes(drives)]) {
    new Chart(parent, 0.8, spec.equal).show(spec, title, note);
  }
}
