// node serve_page.mjs CHROMIUM BIN SOURCE FOLDER: evolves, serves and looks, as a person would.
// A run seen while it is alive, its master killed with -9 and resumed under the open page, two runs
// compared, an address opened again, a drive played, a phone, dark, without scripts, and a server
// that goes away.
import { spawn } from "node:child_process";
import { mkdirSync, rmSync, writeFileSync } from "node:fs";
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

const saidBy = (child, pattern) => new Promise((resolve) => {
  const look = () => pattern.exec(child.said);
  if (look()) return resolve(look());
  for (const stream of [child.stdout, child.stderr]) stream.on("data", () => look() && resolve(look()));
  child.once("exit", () => resolve(look()));
});

const generation = `Number(/after (\\d+) generations/.exec(document.getElementById("headline").textContent)?.[1] || 0)`;
const OVERFLOW = "document.documentElement.scrollWidth - document.documentElement.clientWidth";
const may = (url) => url.startsWith("http://127.0.0.1:");

try {
  rmSync(folder, { recursive: true, force: true });
  mkdirSync(folder, { recursive: true });
  writeFileSync(join(folder, "README"), "Made by serve_page.mjs.\n");
  const config = join(source, "configs/demo.toml");
  const evolve = (out, ...more) => start("evolve", config, "--out", out, "--workers", "1", ...more);
  check((await evolve("short", "--generations", "3").ended) === 0, "the short run did not end well");
  let live = evolve("live", "--generations", "400");
  const server = start("serve", ".", "--port", "0");
  const address = (await saidBy(server, /http:\/\/127\.0\.0\.1:\d+\//))?.[0];
  if (!address) throw new Error(`serve said ${server.said}`);
  const view = (name) => `${address}view?of=${name}`;

  const list = await open(address, { may });
  await until(list, `/2 here, 1 running/.test(document.getElementById("headline").textContent)`, "both runs are listed, one runs");
  await list.picture("serve-list");

  const page = await open(view("live"), { may });
  await until(page, `${generation} >= 2`, "a live run goes on under the open page");
  await until(page, `document.querySelectorAll("#gene-plots .canvas rect").length > 10`, "genes are drawn");
  check(/busy|idle/.test(await page.run(`document.getElementById("farm-now").innerText`)), "no worker is told of");
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

  const compared = await open(`${address}compare?of=live&of=short`, { may });
  await until(compared, `document.querySelectorAll("#compared-plot path").length > 3`, "two runs are drawn");
  await compared.picture("serve-compare");

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
