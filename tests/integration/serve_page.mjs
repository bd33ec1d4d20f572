// node serve_page.mjs CHROMIUM BIN SOURCE FOLDER: evolves, serves and looks, as a person would.
// A run from its first generation to its end, another whose worker and then master are killed with -9
// and which is resumed under the open page, a diagnosis from its first stage to its report, two runs
// compared, addresses opened again, a drive, windows of a ground robot's runs and pushes played, keys only,
// a phone, dark, without events, without scripts, and a server that goes away.
import { spawn } from "node:child_process";
import { existsSync, mkdirSync, readFileSync, rmSync, writeFileSync } from "node:fs";
import { join } from "node:path";
import { check, end, failures, open } from "./browser.mjs";

const [bin, source, folder] = process.argv.slice(3);
const children = new Set();
process.on("exit", () => children.forEach((child) => child.kill("SIGKILL")));

function start(...args) {
  const child = spawn(join(bin, "gapfarm"), args, { cwd: folder, stdio: ["ignore", "pipe", "pipe"] });
  children.add(child);
  child.said = "";
  for (const stream of [child.stdout, child.stderr]) stream.on("data", (text) => { child.said += text; });
  child.ended = new Promise((resolve) => child.once("exit", (code, signal) => { children.delete(child); resolve(code ?? signal); }));
  return child;
}

const sleep = (ms) => new Promise((done) => { setTimeout(done, ms); });

// What holds at last.  A page may load itself again meanwhile, when it gets other sections.
async function until(page, expression, words, ms = 90_000) {
  for (const from = performance.now(); performance.now() - from < ms;) {
    const good = await page.run(`(() => { try { return Boolean(${expression}); } catch { return false; } })()`).catch(() => false);
    if (good) return true;
    await page.run("new Promise((done) => setTimeout(done, 100))").catch(() => null);
  }
  const told = await page.run("document.querySelector('main').innerText.slice(0, 300)").catch((error) => error.message);
  check(false, `${words}: never came; the page says: ${told}`);
  return false;
}

// The server finds a new folder at its next look around.
async function served(url) {
  for (const from = performance.now(); performance.now() - from < 90_000;) {
    if ((await fetch(url)).ok) break;
    await sleep(100);
  }
  return url;
}

const saidBy = (child, pattern) => new Promise((resolve) => {
  const look = () => pattern.exec(child.said);
  if (look()) return resolve(look());
  for (const stream of [child.stdout, child.stderr]) stream.on("data", () => look() && resolve(look()));
  child.once("exit", () => resolve(look()));
});

const generation = `Number(/after (\\d+) generations/.exec(document.getElementById("headline").textContent)?.[1] || 0)`;
const OVERFLOW = "document.documentElement.scrollWidth - document.documentElement.clientWidth";
const TRADED = `scenario = "srv1"
trials = ["${source}/configs/demo/trials.csv"]
[parameters]
step_rate = 60
[genes]
friction = [0.1, 1.5]
full_speed = [0.1, 0.6]
pose_noise_position = [0.0005, 0.03]
[fitness]
objectives = ["position", "heading"]
[optimiser]
kind = "nsga2"
[evolution]
population = 16
`;
const DIAGNOSED = `scenario = "srv1"
[parameters]
step_rate = 60
tread_creep = 0.05
drive_noise_common = 0.012
drive_noise_side = 0.01
pose_noise_position = 0.0015
pose_noise_heading = 0.008
[simulate]
sessions = 2
levels = [0.5, 1.0]
durations = [0.5, 1.0]
`;
const PUSHED = `scenario = "push"
[parameters]
step_rate = 120
[genes]
shape_factor = [0.2, 1.0]
ground_friction = [0.1, 1.0]
[simulate]
sessions = 1
[[pieces]]
name = "square"
corners = [[0, 0], [0.1, 0], [0.1, 0.1], [0, 0.1]]
origin = "centroid"
thickness = 0.01
mass = 0.08
`;
const may = (url) => url.startsWith("http://127.0.0.1:");

// Through the list into a run, along its plots, with keys alone.
async function byKeys(address) {
  const page = await open(`${address}?sort=name`, { may });
  const at = () => page.run(`document.activeElement.getAttribute("href") || document.activeElement.className || document.activeElement.name`);
  const tabTo = async (pattern) => {
    for (let i = 0; i < 80; ++i) {
      await page.key("Tab");
      const now = await at();
      if (pattern.test(now)) return true;
    }
    check(false, `keys: never came to ${pattern}`);
    return false;
  };
  await page.key("Tab");
  check((await at()) === "#work", "keys: the first stop is not the way to the content");
  await tabTo(/sort=seed/);
  await page.key("Enter");
  await until(page, `location.search.includes("sort=seed")`, "keys: sorted");
  await tabTo(/view\?of=short/);
  await page.key("Enter");
  await until(page, `location.pathname === "/view" && document.documentElement.dataset.ready`, "keys: a run is opened");
  if (await tabTo(/canvas/)) {
    await page.key("ArrowRight");
    await until(page, `document.querySelector("#progress-plot .readout").textContent.includes("generation 1")`, "keys: a mark is read");
    await page.run(`redraws.forEach((draw) => draw())`);
    check(/generation 1,/.test(await page.run(`document.querySelector("#progress-plot .readout").textContent`)), "keys: what is new takes the mark from its reader");
    await page.key("+");
    await until(page, `document.querySelector("#progress-plot svg.chart text") !== null`, "keys: zoomed");
    check(await page.run(`getComputedStyle(document.activeElement).outlineStyle !== "none"`), "keys: nobody sees where the focus is");
  }
  await page.call("Page.navigateToHistoryEntry", { entryId: (await page.call("Page.getNavigationHistory")).entries.at(-2).id });
  await until(page, `location.search.includes("sort=seed")`, "keys: back leads to the sorted list");
  await page.close();
}

// Where no events come through, the page asks by itself.
async function withoutEvents(url, resume) {
  const page = await open(url, { may });
  await page.call("Network.setBlockedURLs", { urls: ["*/events*"] });
  await page.call("Page.reload");
  await until(page, `document.documentElement.dataset.ready`, "without events: loaded");
  const before = await page.run(generation);
  const run = resume();
  await until(page, `${generation} > ${before}`, "without events: the page goes on");
  check((await page.run(`document.documentElement.dataset.told`)) !== "true", "without events: it says that it is told");
  run.kill("SIGINT");
  await run.ended;
  await page.close();
}

// Moments at a time, held up in between, until the server's page says so: stages are there to be seen
// however fast the machine is.
async function goOnUntil(command, url, pattern) {
  for (const from = performance.now(); performance.now() - from < 200_000;) {
    command.kill("SIGSTOP");
    const answer = await fetch(url);
    if (answer.ok && pattern.test(await answer.text())) return;
    if (!answer.ok) await sleep(500);  // until the server looks around again
    command.kill("SIGCONT");
    await sleep(30);
  }
  check(false, `the page of ${command.spawnargs.join(" ")} never said ${pattern}`);
}

// From its first stage to its report.
async function diagnosed(view) {
  writeFileSync(join(folder, "d.toml"), DIAGNOSED);
  const made = start("simulate", "d.toml", "--trials", "60", "--seed", "3", "--set", "motor_lag.tau=0.06", "--out", "d.csv", "--workers", "1");
  check((await made.ended) === 0, `nothing to diagnose: ${made.said}`);
  const diagnosis = start("diagnose", "d.toml", "--trials", "d.csv", "--out", "d", "--workers", "1");
  while (!existsSync(join(folder, "d", "simulations.sqlite"))) await sleep(10);
  await goOnUntil(diagnosis, view("d"), /<strong>[1-9] of 6/);
  const page = await open(view("d"), { may });
  // What was found is there before the report is, stage by stage.
  for (const about of ["the base model", "what the catalogue offers"]) {
    await goOnUntil(diagnosis, view("d"), RegExp(`<h4>${about}</h4>`));
    await until(page, `[...document.querySelectorAll("#found-list h4")].some((h) => h.textContent === "${about}")`, `it is told of ${about}`);
  }
  check(/[1-9] of 6/.test(await page.run(`document.querySelector("#tiles").innerText`)), "no stage of a diagnosis is shown");
  diagnosis.kill("SIGCONT");
  await page.picture("serve-diagnosis-live");
  await until(page, `document.getElementById("shrinkage") || document.getElementById("screening")`, "the diagnosis becomes its report", 400_000);
  check((await diagnosis.ended) === 0, `the diagnosis did not end well: ${diagnosis.said}`);
  for (const complaint of page.complaints) check(/404|503/.test(complaint), `diagnosis: ${complaint}`);
  await page.picture("serve-diagnosis");
  await page.close();
}

// Windows of runs: a ground robot's, those that were held out, too.
async function windows(view) {
  const rover = (name) => join(source, "configs/rover", name);
  for (const day of ["monday", "tuesday"]) {
    const made = start("import", "runs", rover(`${day}_cmd_vel.csv`), rover(`${day}_tracker.csv`), "--out", day);
    check((await made.ended) === 0, `runs were not imported: ${made.said}`);
  }
  const robot = start("robot", rover("rover.urdf"), "--controllers", rover("control.yaml"), "--out", "robot.toml");
  check((await robot.ended) === 0, `no robot: ${robot.said}`);
  writeFileSync(join(folder, "rover.toml"), `scenario = "ground"
[robot]
file = "robot.toml"
[runs]
folders = ["monday"]
[validation]
folders = ["tuesday"]
[genes]
delay = "table"
lag = "table"
wheels.left.radius = "table"
`);
  const run = start("evolve", "rover.toml", "--out", "rover", "--generations", "1", "--population", "4", "--workers", "1");
  check((await run.ended) === 0, `the rover's run did not end well: ${run.said}`);
  const page = await open(await served(`${view("rover")}&trial=3`), { may });
  const title = `document.querySelector("#watch-plot h4")?.textContent`;
  await until(page, `/^Window 3 .*, at 2.0. s of 2/.test(${title})`, "a window is shown");
  const measured = `fetch("/drive?of=rover&trial=3").then((answer) => answer.json()).then((drive) => drive.measured.length)`;
  check((await page.run(measured)) > 15, "the poses that were measured on the way are not drawn");
  await page.run(`document.getElementById("watch").scrollIntoView()`);
  await page.picture("serve-window");
  const kept = await page.run(`PAGE.logged_trials + 2`);
  const apart = await open(`${view("rover")}&trial=${kept}`, { may });
  await until(apart, `/^Window ${kept} .*held out/.test(${title})`, "a window that was held out is shown");
  check(/never saw this window/.test(await apart.run(`document.getElementById("watch-plot").innerText`)), "it is not marked");
  for (const complaint of [...page.complaints, ...apart.complaints]) check(false, `windows: ${complaint}`);
  await page.close();
  await apart.close();
}

// Pushes: the piece's outline as measured and as simulated, and the finger's way.
async function pushes(view) {
  writeFileSync(join(folder, "push.toml"), PUSHED);
  const made = start("simulate", "push.toml", "--trials", "8", "--out", "pushes.csv", "--workers", "1");
  check((await made.ended) === 0, `nothing was pushed: ${made.said}`);
  const run = start("evolve", "push.toml", "--trials", "pushes.csv", "--out", "push", "--generations", "1", "--population", "4", "--workers", "1");
  check((await run.ended) === 0, `the pushes' run did not end well: ${run.said}`);
  const page = await open(await served(`${view("push")}&trial=2`), { may });
  await until(page, `/^Trial 2 /.test(document.querySelector("#watch-plot h4")?.textContent)`, "a push is shown");
  const closed = `[...document.querySelectorAll("#watch-plot path")].filter((p) => p.getAttribute("d").split("L").length === 5).length`;
  check((await page.run(closed)) >= 3, "three outlines of the piece are not drawn");
  for (const complaint of page.complaints) check(false, `pushes: ${complaint}`);
  await page.run(`document.getElementById("watch").scrollIntoView()`);
  await page.picture("serve-push");
  await page.close();
}

// Choices are steps that back takes back and forward does again; what cannot be read says why.
async function backAndBroken(address, view) {
  const page = await open(await served(view("short")), { may });
  const choose = (value) => page.run(`(() => { const s = document.querySelector("#progress-controls select"); s.value = "${value}"; s.dispatchEvent(new Event("change")); })()`);
  const chosen = (value) => `document.querySelector("#progress-controls select").value === "${value}"`;
  await choose("evaluations");
  await choose("minutes");
  await page.run("history.back()");
  await until(page, `${chosen("evaluations")} && location.search.includes("against=evaluations")`, "back takes a choice back");
  await page.run("history.back()");
  await until(page, `${chosen("generation")} && !location.search.includes("against")`, "back takes the first choice back");
  await page.run("history.forward()");
  await until(page, chosen("evaluations"), "forward chooses again");
  for (const complaint of page.complaints) check(false, `back: ${complaint}`);
  await page.close();
  mkdirSync(join(folder, "broken"));
  writeFileSync(join(folder, "broken/run.sqlite"), "no store");
  const broken = await open(address, { may });
  await until(broken, `/not a SQLite file/.test(document.getElementById("entries").innerText)`, "a store that is none is told of");
  await broken.close();
  const why = await open(view("broken"), { may });
  check(/not a SQLite file/.test(await why.run(`document.getElementById("why")?.textContent`)), "its page does not say why");
  check((await why.run(OVERFLOW)) <= 0, "a page that says why is wider than the window");
  await why.picture("serve-broken");
  await why.close();
  rmSync(join(folder, "broken"), { recursive: true });
}

// What is traded off, and what the parameters do.
async function front(page) {
  await until(page, `document.querySelectorAll("#front-plots figure").length === 2`, "the front and its hypervolume are drawn");
  const marks = `Math.max(...[...document.querySelectorAll("#front-plots figure:first-child .canvas path")].map((p) => p.getAttribute("d").split("M").length))`;
  check((await page.run(marks)) > 6, "no front is drawn");
  check((await page.run(`document.querySelector("#front-plots .canvas").textContent`)).includes("knee"), "the knee is not marked");
  await page.run(`document.querySelector("#front-plots .canvas").focus()`);
  await page.call("Input.dispatchKeyEvent", { type: "keyDown", key: "ArrowRight", code: "ArrowRight" });
  check(/genome \d+: position .*, heading/i.test(await page.run(`document.querySelector("#front-plots .readout").textContent`)), "a member does not say what it is");
  check(/position/.test(await page.run(`document.querySelector("#elite-plot .canvas").textContent`)), "no objective among the coordinates");
  check((await page.run(`document.querySelectorAll("#importance-table tbody tr").length`)) === 3, "not every parameter has its importance");
  const cells = `document.querySelectorAll("#contour-plot .canvas rect").length`;
  check((await page.run(cells)) > 10, "no contour is drawn");
  const title = `document.querySelector("#contour-plot h4").textContent`;
  const before = await page.run(title);
  await page.run(`(() => { const s = document.querySelectorAll("#contour-controls select")[2]; s.value = "1"; s.dispatchEvent(new Event("change")); })()`);
  check(/heading over/.test(await page.run(title)) && !/heading over/.test(before), "another objective is not drawn");
  check((await page.run(OVERFLOW)) <= 0, "the page of a front is wider than the window");
  await page.run(`document.getElementById("front").scrollIntoView()`);
  await page.picture("serve-front");
  await page.run(`document.getElementById("understanding").scrollIntoView()`);
  await page.picture("serve-understanding");
  for (const complaint of page.complaints) check(false, `front: ${complaint}`);
  await page.close();
}

try {
  rmSync(folder, { recursive: true, force: true });
  mkdirSync(folder, { recursive: true });
  writeFileSync(join(folder, "README"), "Made by serve_page.mjs.\n");
  const config = join(source, "configs/demo.toml");
  const evolve = (out, ...more) => start("evolve", config, "--out", out, "--workers", "1", ...more);
  check((await evolve("short", "--generations", "3").ended) === 0, "the short run did not end well");
  writeFileSync(join(folder, "front.toml"), TRADED);
  const traded = start("evolve", "front.toml", "--out", "deep/front", "--generations", "8", "--workers", "1");
  check((await traded.ended) === 0, "the run of two objectives did not end well");
  const server = start("serve", ".", "--port", "0");
  const address = (await saidBy(server, /http:\/\/127\.0\.0\.1:\d+\//))?.[0];
  if (!address) throw new Error(`serve said ${server.said}`);
  const view = (name) => `${address}view?of=${name}`;

  await front(await open(await served(view("deep/front")), { may }));
  rmSync(join(folder, "deep"), { recursive: true });

  // From before its first generation to its end.
  const whole = evolve("whole", "--generations", "8");
  await saidBy(whole, /evolving/);
  const first = await open(await served(view("whole")), { may });
  await until(first, `document.getElementById("headline") !== null || (location.reload(), false)`, "a new run is found");
  await until(first, `${generation} >= 1`, "its first generation is shown");
  await until(first, `/^finished/.test(document.getElementById("state").textContent)`, "it is seen to end");
  check((await first.run(generation)) === 8, "not all of its generations are shown");
  await until(first, `document.querySelectorAll("#pose-plots .canvas path").length > 3`, "its end poses are drawn");
  check((await whole.ended) === 0, "the whole run did not end well");
  await first.picture("serve-whole");
  await first.close();

  let live = evolve("live", "--generations", "400");
  await saidBy(live, /evolving/);
  await served(view("live"));
  const list = await open(address, { may });
  await until(list, `/3 here, 1 running/.test(document.getElementById("headline").textContent)`, "both runs are listed, one runs");
  await list.picture("serve-list");
  await list.run(`(() => { const f = document.getElementById("filter"); f.q.value = "short"; f.q.dispatchEvent(new Event("input", { bubbles: true })); })()`);
  await until(list, `document.querySelectorAll("#entries tbody tr").length === 1 && location.search.includes("q=short")`, "the list is filtered and its address says so");
  await list.close();

  const page = await open(await served(view("live")), { may });
  await until(page, `${generation} >= 2`, "a live run goes on under the open page");
  await until(page, `document.querySelectorAll("#gene-plots .canvas rect").length > 10`, "genes are drawn");
  check(/busy|idle/.test(await page.run(`document.getElementById("farm-now").innerText`)), "no worker is told of");
  await until(page, `document.documentElement.dataset.told === "true"`, "the server tells of what is new");
  check((await page.run(`document.querySelectorAll("#elite-plot .canvas path").length`)) > 10, "the elite is not drawn");

  // A worker that dies is told of, with its reason.
  const workerOf = (pid) => Number(readFileSync(`/proc/${pid}/task/${pid}/children`, "utf8").trim().split(" ")[0]);
  process.kill(workerOf(live.pid), "SIGKILL");
  await until(page, `/killed by signal 9/.test(document.getElementById("farm-past").textContent)`, "a dead worker is told of");
  await until(page, `document.querySelectorAll("#timeline-plot figure").length === 2`, "who was there is drawn");
  await page.run(`document.getElementById("farm").scrollIntoView()`);
  await page.picture("serve-live");
  live.kill("SIGKILL");
  await live.ended;
  await until(page, `/crashed|gone/.test(document.getElementById("state").textContent)`, "a killed master is seen");
  const last = await page.run(generation);
  live = start("resume", "live", "--workers", "1");
  await until(page, `${generation} > ${last} && /^running/.test(document.getElementById("state").textContent)`, "the resumed run goes on");
  for (const complaint of page.complaints) check(false, `live: ${complaint}`);
  live.kill("SIGINT");
  check((await live.ended) === 85, "the run was not stopped");
  await until(page, `/^stopped/.test(document.getElementById("state").textContent)`, "a stopped run is seen");
  const fresh = `fetch(location.href).then((answer) => answer.text()).then((text) => new DOMParser().parseFromString(text, "text/html").getElementById("snippet").textContent)`;
  check((await page.run(`document.getElementById("snippet").textContent`)) === (await page.run(fresh)), "the parameters are not the last best's");

  // A drive, played by keys, and its address opened again.
  await page.run(`(() => { const t = document.querySelector("#watch-controls input[type=number]"); t.value = 7; t.focus(); })()`);
  await page.key("Enter");
  await until(page, `/^Trial 7 /.test(document.querySelector("#watch-plot h4").textContent)`, "trial 7 is shown");
  await page.run(`document.querySelector("#watch-controls input[type=range]").focus()`);
  await page.key("Home");
  check(/at 0\.00 s/.test(await page.run(`document.querySelector("#watch-plot h4").textContent`)), "scrub: Home does not show the start");
  await page.run(`[...document.querySelectorAll("#watch-controls button")].find((b) => b.textContent === "Play").click()`);
  await until(page, `[...document.querySelectorAll("#watch-controls button")].some((b) => b.textContent === "Play") && document.querySelector("#watch-controls input[type=range]").value === "1000"`, "the drive plays to its end");
  const address7 = await page.run("location.href");
  const again = await open(address7, { may });
  await until(again, `/^Trial 7 /.test(document.querySelector("#watch-plot h4")?.textContent)`, "the address opens trial 7 again");
  await again.run(`document.getElementById("watch").scrollIntoView()`);
  await again.picture("serve-watch");

  // What was chosen stands in the address, and comes back with it.
  await again.run(`(() => { const s = document.querySelector("#progress-controls select"); s.value = "evaluations"; s.dispatchEvent(new Event("change")); })()`);
  const chosen = await again.run("location.href");
  check(/against=evaluations/.test(chosen) && /trial=7/.test(chosen), `the address does not say what was chosen: ${chosen}`);
  const reopened = await open(chosen, { may });
  check((await reopened.run(`document.querySelector("#progress-controls select").value`)) === "evaluations", "the address does not choose again");
  await reopened.close();
  await again.close();

  const compared = await open(`${address}compare?of=live&of=short`, { may });
  await until(compared, `document.querySelectorAll("#compared-plot path").length > 3`, "two runs are drawn");
  await compared.picture("serve-compare");
  await compared.close();

  await byKeys(address);
  await withoutEvents(view("live"), () => start("resume", "live", "--workers", "1"));
  await diagnosed(view);
  await windows(view);
  await pushes(view);
  await backAndBroken(address, view);

  for (const [name, url, options] of [
    ["serve-phone", view("short"), { width: 390, height: 844, dark: true }],
    ["serve-list-phone", address, { width: 390, height: 844 }],
    ["serve-wide", view("short"), { width: 1600, height: 1000, dark: true }],
  ]) {
    const one = await open(url, { ...options, may });
    check((await one.run(OVERFLOW)) <= 0, `${name}: wider than the window`);
    check((await one.run("document.documentElement.dataset.ready")) === "true", `${name}: the scripts did not end`);
    for (const complaint of one.complaints) check(false, `${name}: ${complaint}`);
    await one.picture(name);
    await one.close();
  }
  const bare = await open(view("short"), { scripts: false, may });
  const { root } = await bare.call("DOM.getDocument", { depth: 1 });
  const { outerHTML } = await bare.call("DOM.getOuterHTML", { nodeId: root.nodeId });
  for (const words of ["contact_length", "gapfarm replay short --genome", "Reload the page", "after 3 generations"]) {
    check(outerHTML.includes(words), `without scripts: no "${words}"`);
  }

  server.kill("SIGTERM");
  check((await server.ended) === 143, "the server did not end at SIGTERM");
  await page.call("Page.bringToFront");  // nobody sees it behind the others, and then it does not look
  await until(page, `/does not answer/.test(document.getElementById("live").textContent)`, "a gone server is told of");
} catch (error) {
  failures.push(error.stack);
} finally {
  for (const child of [...children]) {
    child.kill("SIGKILL");
    await child.ended;
  }
  rmSync(folder, { recursive: true, force: true });
  await end("served page");
}
