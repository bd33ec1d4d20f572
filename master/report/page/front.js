"use strict";
// Of a run with several objectives: the front with its knee, and the hypervolume by generation.

function frontSpec(x, y) {
  const { objectives } = PAGE.front;
  const members = PAGE.front.members.map((member) => ({ ...member, values: Object.values(member.objectives) }));
  const knee = members.findIndex(({ birth_id }) => birth_id === PAGE.front.knee);
  const axis = (m) => {
    const range = extent(members.map(({ values }) => values[m]));
    return { ...roomy(...range, 0.06), label: `${objectives[m].name}, ${objectives[m].maximise ? "higher" : "lower"} is better` };
  };
  const marks = members.map((member, k) => [member.values[x], member.values[y], { member, k }]);
  const evaluated = (PAGE.sample?.evaluated || []).filter((one) => one[3].length > Math.max(x, y));
  return {
    x: axis(x), y: axis(y),
    layers: [
      { kind: "points", style: "quiet", shape: "dot", faint: 0.35, name: "evaluated", points: evaluated.map((one) => [one[3][x], one[3][y]]) },
      { kind: "line", style: "final", width: 1.2, faint: 0.5, name: "front", points: objectives.length === 2 ? marks : [] },
      { kind: "points", style: "final", shape: "dot", name: "front", points: marks.filter((_, k) => k !== knee) },
      { kind: "points", style: "tuned", shape: "diamond", name: "knee", points: [marks[knee]] },
      { kind: "text", style: "tuned", text: "knee", points: [marks[knee].slice(0, 2)] },
    ],
    describe: ({ member, k }) => `${k === knee ? "The knee, genome" : "Genome"} ${member.birth_id}: ${objectives.map(({ name }, m) => `${name} ${numberText(member.values[m], 6)}`).join(", ")}`,
  };
}

function startFront() {
  const parent = document.getElementById("front-plots");
  if (!parent || !PAGE.front?.members.length) return;
  const controls = document.getElementById("front-controls");
  const names = PAGE.front.objectives.map(({ name }, m) => [String(m), name]);
  // Two are drawn against each other, first against second unless others are chosen.
  const chosen = ["Across", "Up"].map((title, m) => (names.length < 3 ? () => m
    : choice(controls, title, [...names.slice(m), ...names.slice(0, m)], draw, `front_${title.toLowerCase()}`)));
  const plot = new Chart(parent, 0.8);
  const volumes = new Chart(parent, 0.8);
  function draw(keep) {
    const { front } = PAGE;
    if (!front.members.length) return;
    plot.show(frontSpec(Number(chosen[0]()), Number(chosen[1]())), "The front of the last generation",
      "Blue: beaten by none; orange: their knee; grey: others that were evaluated.", keep);
    const points = front.hypervolume;
    volumes.figure.hidden = !points.length;
    if (!points.length) return;
    const [least, most] = extent(points.map((p) => p[1]));
    volumes.show({
      x: { min: points[0][0], max: Math.max(points.at(-1)[0], points[0][0] + 1), label: "generation" },
      y: { min: least, max: most * 1.02 || 1, label: "hypervolume" },
      layers: [
        { kind: "line", style: "final", width: 2, name: "hypervolume", points },
        { kind: "points", style: "final", shape: "dot", faint: 0.3, name: "hypervolume", points: points.map(([g, v]) => [g, v, { g, v }]) },
      ],
      describe: ({ g, v }) => `generation ${g}: ${numberText(v, 6)}`,
    }, "Hypervolume", `Within ${front.objectives.map(({ reference }) => numberText(reference, 4)).join(", ")}: the worst of the first generation.`, keep);
  }
  drawLive(draw);
}
