"use strict";
// A run: its fitness as it went on.

const AGAINST = [
  { key: "generation", label: "generation", of: (g) => g.generation },
  { key: "evaluations", label: "evaluations", of: (g) => g.evaluations },
  { key: "minutes", label: "wall time, min", of: (g) => g.wall_s / 60 },
];

function startProgress() {
  const parent = document.getElementById("progress-plot");
  const { fitness } = PAGE;
  if (!parent || !PAGE.generations?.length) return;
  const controls = document.getElementById("progress-controls");
  const chart = new Chart(parent, 0.45, true);
  const against = choice(controls, "Against", AGAINST.map((a) => [a.key, a.label]), draw, "against");
  const all = PAGE.generations.flatMap((g) => [g.best, g.median]).filter(isNumber);
  const canLog = all.length && all.every((v) => v > 0);
  const scale = canLog
    ? radios(controls, "Scale", [{ key: "linear", label: "linear" }, { key: "log", label: "log" }], draw, "scale") : () => "linear";
  if (!canLog) element(controls, "span", { className: "quiet" }, "No logarithmic scale: some values are not above 0.");

  function draw(keep) {
    const { of, label } = AGAINST.find((a) => a.key === against());
    const known = PAGE.generations.filter((g) => isNumber(g.best));
    const line = (key) => known.map((g) => [of(g), g[key]]);
    const marks = known.map((g) => [of(g), g.best, g]);
    const low = (g) => (isNumber(g.worst) ? g.worst : g.best);
    // The first generations' worst would leave no room for what matters: bests, and most medians.
    const medians = known.map((g) => g.median).filter(isNumber).sort((a, b) => a - b);
    const usual = medians.length ? [quantile(medians, fitness.higher_is_better ? 0.1 : 0.9)] : [];
    const values = [...known.map((g) => g.best), ...usual];
    const [min, max] = extent(values);
    const log = scale() === "log";
    const [from, to] = extent(known.map(of));
    chart.show(
      { x: { min: from, max: to > from ? to : from + 1, label },
        y: { ...(log ? { min: min / 1.05, max: max * 1.05 } : roomy(min, max, 0.06)), log, label: withUnit(fitness.name, fitness.unit) },
        layers: [
          { kind: "band", style: "final", points: known.map((g) => [of(g), Math.min(low(g), g.best), Math.max(low(g), g.best)]), name: `${fitness.best} to worst` },
          { kind: "line", style: "quiet", points: line("median"), dashed: true, name: "median" },
          { kind: "line", style: "final", points: line("best"), width: 2.5, name: fitness.best },
          { kind: "points", style: "final", shape: "dot", points: marks, faint: known.length > 200 ? 0.01 : 0.6, name: fitness.best },
        ],
        describe: (g) => `generation ${g.generation}, ${numberText(g.evaluations, 6)} evaluations: ${fitness.best} ${numberText(g.best, 6)}, median ${numberText(g.median, 4)}, worst ${numberText(g.worst, 4)}` },
      `${fitness.name} by ${label}`,
      `Line: ${fitness.best}; dashed: median; shaded: ${fitness.best} to worst. ${fitness.higher_is_better ? "Higher" : "Lower"} is better.`,
      keep,
    );
  }
  drawLive(draw);
}
