"use strict";
// Of a run: which workers were there, who came, who went and who failed.

const CAME = {  // by what a mark is of
  joined: { style: "final", shape: "dot" },
  left: { style: "quiet", shape: "diamond" },
  failed: { style: "tuned", shape: "cross" },
  master: { style: "place", shape: "diamond" },
};

// Minutes or hours since the run began, whichever is easier to read.
function timeAxis({ counts, end }) {
  const from = counts[0].unix_s;
  const span = Math.max(end - from, 1);
  const [unit, seconds] = span > 3 * 3600 ? ["hours", 3600] : span > 180 ? ["minutes", 60] : ["seconds", 1];
  const began = new Date(1000 * from).toISOString().slice(0, 16).replace("T", " ");
  return { of: (unix) => (unix - from) / seconds, axis: { min: -0.015 * (span / seconds), max: 1.02 * (span / seconds), label: `${unit} since ${began} UTC` } };
}

function countSpec(timeline) {
  const { of, axis } = timeAxis(timeline);
  const steps = [];
  timeline.counts.forEach(({ unix_s, workers }) => {
    if (steps.length) steps.push([of(unix_s), steps.at(-1)[1]]);
    steps.push([of(unix_s), workers]);
  });
  const most = Math.max(1, ...timeline.counts.map(({ workers }) => workers));
  return {
    x: axis,
    y: { min: -0.06 * most, max: 1.08 * most, label: "workers", ticks: most <= 8 ? Array.from({ length: most + 1 }, (_, i) => [i, String(i)]) : undefined },
    layers: [
      { kind: "line", style: "final", width: 2, name: "workers", points: steps },
      ...Object.entries(CAME).map(([kind, { style, shape }]) => (
        { kind: "points", style, shape, name: kind, points: timeline.marks.filter((m) => m.kind === kind).map((m) => [of(m.unix_s), m.workers, m]) })),
    ],
    describe: (m) => m.text,
  };
}

function spanSpec(timeline) {
  const { of, axis } = timeAxis(timeline);
  const { spans } = timeline;
  const row = (i) => spans.length - 1 - i;
  const short = (name) => (name.length > 20 ? `…${name.slice(-19)}` : name);
  const describeStay = (s) => `${s.name}${s.host ? ` on ${s.host}` : ""}, for ${numberText((s.to_unix_s - s.from_unix_s) / 60)} min${s.end ? `, then it ${s.end}` : ""}`;
  return {
    x: axis,
    y: { min: -0.7, max: spans.length - 0.3, label: "", room: Math.min(150, 16 + 6.6 * Math.max(...spans.map(({ name }) => short(name).length))), ticks: spans.map(({ name }, i) => [row(i), short(name)]) },
    layers: [
      ...spans.map((s, i) => ({ kind: "line", style: "final", width: 6, name: s.name, points: [[of(s.from_unix_s), row(i)], [Math.max(of(s.to_unix_s), of(s.from_unix_s) + 0.003 * axis.max), row(i)]] })),
      { kind: "points", style: "final", shape: "dot", faint: 0.01, name: "there", points: spans.map((s, i) => [of(s.to_unix_s), row(i), s]) },
      { kind: "points", style: "tuned", shape: "cross", name: "failed", points: spans.flatMap((s, i) => (s.end ? [[of(s.to_unix_s), row(i), s]] : [])) },
    ],
    describe: describeStay,
  };
}

function startTimeline() {
  const parent = document.getElementById("timeline-plot");
  if (!parent || !PAGE.timeline?.counts.length) return;
  const count = new Chart(parent, 0.24, true);
  let spans = null;
  function draw(keep) {
    const { timeline } = PAGE;
    if (!timeline?.counts.length) return;
    const note = "Dot: joined; grey diamond: left; cross: failed; purple diamond: a master began or ended.";
    count.show(countSpec(timeline), "Workers", note, keep);
    if (!timeline.spans.length) return;
    if (!spans) {
      spans = new Chart(parent, 0.3, true);
    }
    spans.aspect = Math.max(0.14, 0.028 * timeline.spans.length + 0.08);
    spans.show(spanSpec(timeline), "From when to when each was there", "A cross at the end: it failed.", keep);
  }
  drawLive(draw);
}
