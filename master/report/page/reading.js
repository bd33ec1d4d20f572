"use strict";
// What helps to read a page: terms explained where they stand, tables and texts to take away.

// --- terms: links into the glossary, whose entry shows beside the word ---

function startTerms() {
  const tip = element(document.body, "div", { id: "tip", role: "tooltip", hidden: true });
  const hide = () => { tip.hidden = true; };

  function show(link) {
    const entry = document.getElementById(link.getAttribute("href").slice(1));
    if (!entry) return;
    tip.textContent = entry.querySelector("dd").textContent;
    tip.hidden = false;
    const room = document.documentElement.clientWidth;
    const at = link.getBoundingClientRect();
    tip.style.left = `${Math.max(8, Math.min(at.left, room - tip.offsetWidth - 8))}px`;
    const above = at.bottom + tip.offsetHeight + 8 > innerHeight;
    tip.style.top = `${above ? at.top - tip.offsetHeight - 6 : at.bottom + 6}px`;
  }

  // Of every term, also of those that a live page puts in place later.
  const on = (type, act) => document.addEventListener(type, (event) => {
    const link = event.target.closest?.("a.term");
    if (link) act(link, event);
  });
  for (const type of ["pointerover", "focusin"]) {
    on(type, (link) => {
      link.setAttribute("aria-describedby", link.getAttribute("href").slice(1));
      show(link);
    });
  }
  for (const type of ["pointerout", "focusout"]) on(type, hide);
  // A finger has no other way to ask; the glossary is one more tap away.
  on("click", (link, event) => {
    if (!tip.hidden && matchMedia("(hover: none)").matches) event.preventDefault();
  });
  addEventListener("keydown", (event) => event.key === "Escape" && hide());
  addEventListener("scroll", hide, { passive: true });
}

// --- tables and texts ---

const cellText = (cell) => {
  const copy = cell.cloneNode(true);
  for (const extra of copy.querySelectorAll("button, svg, .tag")) extra.remove();
  return copy.textContent.trim().replace(/\s+/g, " ").replaceAll("−", "-");
};

// Of all tables within `root`.
function startTables(root = document) {
  for (const table of root.querySelectorAll("table[data-file]")) {
    const button = Object.assign(document.createElement("button"), { type: "button", className: "take", textContent: "CSV" });
    button.title = "Save this table as CSV";
    button.setAttribute("aria-label", `Save the table ${table.caption?.textContent || table.dataset.file} as CSV`);
    button.addEventListener("click", () => {
      const rows = [...table.rows].map((row) => [...row.cells].map(cellText));
      offer(`${table.dataset.file}.csv`, "text/csv", csvText(rows));
    });
    table.after(button);
  }
  if (root !== document) return;
  const all = document.getElementById("all-trials");
  all?.addEventListener("click", () => {
    const { columns, rows } = readJson("trials");
    offer("trials.csv", "text/csv", csvText([columns, ...rows]));
  });
  if (all) all.hidden = !readJson("trials").rows.length;
}

async function copyText(source) {
  try {
    await navigator.clipboard.writeText(source.textContent);
    return true;
  } catch {
    // No clipboard for this page: what is selected can be copied by hand, if not by the browser.
    const range = document.createRange();
    range.selectNodeContents(source);
    getSelection().removeAllRanges();
    getSelection().addRange(range);
    return document.execCommand("copy");
  }
}

function startCopies(root = document) {
  for (const button of root.querySelectorAll("button.copy")) {
    button.hidden = false;
    const label = button.textContent;
    button.addEventListener("click", async () => {
      const done = await copyText(document.getElementById(button.dataset.of));
      button.textContent = done ? "Copied" : "Selected: copy it with Ctrl-C";
      setTimeout(() => { button.textContent = label; }, 3000);
    });
  }
}

// --- moving about ---

function goTo(id) {
  const title = document.querySelector(`#${id} h2, #${id} h3, h3#${id}`) || document.getElementById(id);
  title.tabIndex = -1;
  title.focus({ preventScroll: true });
  title.scrollIntoView({ behavior: matchMedia("(prefers-reduced-motion: reduce)").matches ? "auto" : "smooth" });
}
