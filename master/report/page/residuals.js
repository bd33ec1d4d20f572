"use strict";
// Residuals against one covariate at a time, component by component.

// Means of neighbouring trials: one bin a value where there are few values, else equal counts.
function binned(points, most = 9) {
  const sorted = points.filter((p) => isNumber(p[0]) && isNumber(p[1])).sort((a, b) => a[0] - b[0]);
  const values = groupBy(sorted, (p) => p[0]);
  const size = Math.max(Math.ceil(sorted.length / most), 4);
  const bins = values.size <= most ? [...values.values()] : [];
  for (let i = 0; !(values.size <= most) && i < sorted.length; i += size) bins.push(sorted.slice(i, i + size));
  return bins.map((bin) => {
    const ys = bin.map((p) => p[1]);
    const y = mean(ys);
    const spread = bin.length > 1 ? Math.sqrt(mean(ys.map((v) => (v - y) ** 2)) / (bin.length - 1)) : 0;
    return { x: mean(bin.map((p) => p[0])), y, half: 1.645 * spread };
  });
}

// Layers of one model: its trials and the binned means with their intervals.
function residualLayers(trials, model, covariate, component) {
  const points = trials.map((t) => [covariate.of(t), 1000 * t[`${model}_residual_${component}`], t]);
  const bins = binned(points);
  const line = [{ kind: "line", style: model, points: bins.map((b) => [b.x, b.y]), dashed: model === "tuned", width: 2.5 }];
  const bars = bins.map((b) => ({ kind: "line", style: model, points: [[b.x, b.y - b.half], [b.x, b.y + b.half]], width: 2 }));
  return { marks: { kind: "points", shape: SHAPE[model], style: model, points, faint: true }, over: [...line, ...bars], bins, model };
}

// Each model's name at the end of its line: the upper one above it, the other below.
function nameLayers(layers) {
  const ends = layers.filter((l) => l.bins.length).map((l) => ({ model: l.model, end: l.bins.at(-1) }));
  ends.sort((a, b) => b.end.y - a.end.y);
  return ends.map(({ model, end }, i) => ({
    kind: "text", style: model, text: MODEL_NAME[model], anchor: "end", below: i > 0,
    points: [[end.x, end.y + (i > 0 ? -end.half : end.half)]],
  }));
}

function showResidual(chart, trials, models, covariate, component) {
  const layers = models.map((model) => residualLayers(trials, model, covariate, component));
  // Every mean is within the frame; a few wild trials need not be.
  const y = robustLimits(layers.flatMap((l) => l.marks.points.map((p) => p[1])),
    [0, ...layers.flatMap((l) => l.bins.flatMap((b) => [b.y - b.half, b.y + b.half]))]);
  const xs = trials.map(covariate.of).filter(isNumber);
  const [from, to] = xs.length ? extent(xs) : [0, 1];
  const margin = 0.04 * (to - from) || 0.5;
  const zero = { kind: "line", style: "quiet", points: [[from - margin, 0], [to + margin, 0]], width: 1 };
  chart.show(
    { x: { min: from - margin, max: to + margin, label: covariate.label },
      y: { ...y, label: `${COMPONENT[component]}, ${UNIT[component]}` },
      layers: [zero, ...layers.map((l) => l.marks), ...layers.flatMap((l) => l.over), ...nameLayers(layers)],
      describe: describeTrial, picked: showDrive },
    `${COMPONENT[component]}, ${UNIT[component]}`,
    "",
  );
}

function startResiduals(trials, findings) {
  const controls = document.getElementById("residual-controls");
  const parent = document.getElementById("residual-plots");
  const panels = AXES.map(() => new Chart(parent, 0.8));
  const marked = new Set(findings.map((w) => covariateOf(w.covariate)?.key));
  const usable = COVARIATES.filter((c) => new Set(trials.map(c.of).filter(isNumber)).size > 1);
  const offered = usable.length ? usable : COVARIATES.slice(0, 1);
  const commands = commandsOf(trials);
  const against = choice(controls, "Against",
    offered.map((c) => [c.key, c.label + (marked.has(c.key) ? " ◆ a finding" : "")]), draw);
  const command = choice(controls, "Command", [["all", "all"], ...commands.map((c) => [c, commandName(c)])], draw);
  const shown = checks(controls, "Show", MODELS, draw);

  function draw() {
    const covariate = COVARIATES.find((c) => c.key === against());
    const some = command() === "all" ? trials : trials.filter((t) => t.command === command());
    AXES.forEach((component, i) => showResidual(panels[i], some, shown(), covariate, component));
  }

  function aim(text, of) {
    const covariate = covariateOf(text);
    if (covariate && offered.includes(covariate)) against.set(covariate.key);
    command.set(commands.includes(of) ? of : "all");
    draw();
  }

  for (const button of document.querySelectorAll("button.show")) {
    const { covariate } = button.dataset;
    if (covariate && !offered.includes(covariateOf(covariate))) continue;
    button.hidden = false;
    button.addEventListener("click", () => {
      aim(covariate, button.dataset.command);
      goTo("residual-title");
    });
  }
  const first = findings.find((w) => offered.includes(covariateOf(w.covariate)));
  aim(first?.covariate ?? "", first?.command ?? "all");
}
