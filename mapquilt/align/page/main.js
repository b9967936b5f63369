// The page: its state, the requests that change it, and the wiring of buttons and keys.

import { call, getBytes, getJson } from "./api.js";
import { about, compose, inverse, shifted } from "./geometry.js";
import { $, answerText, element, pairItem, showMaps, showPose, showScores, showVerdict, status } from "./panel.js";
import { Raster } from "./raster.js";
import { thumbnail } from "./thumbnail.js";
import { View } from "./view.js";

const MOST_CANDIDATES = 4;

const page = {
  maps: [], poses: [], decided: [], reference: 0, selected: 0, hidden: new Set(), locked: new Set(), walls: new Map(),
  scaleFixed: true, coloured: true, busy: false, typing: false, frames: [], readOnly: false, solved: null,
};

// A locked map stays, and all maps inside a report. So does the reference of more than two maps, since its move would not
// tell on which of them it lies.
page.fixed = (index) => page.readOnly || page.locked.has(index) || (index === page.reference && page.maps.length > 2);

const others = () => page.maps.map((_, index) => index).filter((index) => index !== page.selected && !page.hidden.has(index));
const pose = (index) => { const { x, y, yaw, scale } = page.poses[index]; return { x, y, yaw, scale }; };
const fromReference = () => compose(inverse(page.poses[page.reference]), page.poses[page.selected]);

// --- Measurements: at most one request at a time, always of the latest pose ------------------------------------------
let measuring = false, stale = false;
const measure = async () => {
  stale = true;
  if (measuring || page.busy) return;
  measuring = true;
  while (stale && !page.busy) {
    stale = false;
    const index = page.selected, among = others();
    try {
      const found = await call("measure", { map: index, ...pose(index), others: among });
      if (index !== page.selected) { stale = true; continue; }
      page.walls = classesOf(found.walls);
      showScores(page, found.pairs); view.ask();
    } catch (error) { status(error.message, true); break; }
  }
  measuring = false;
};

// --- State -------------------------------------------------------------------------------------------------------------
const adopt = (state) => {
  page.poses = state.placements.map(({ x, y, yaw, scale }) => ({ x, y, yaw, scale }));
  page.decided = state.placements.map((each) => each.decided_by);
  page.reference = state.reference;
  $("undo").disabled = !state.undo; $("redo").disabled = !state.redo;
  show(); measure();
};

const show = () => { showMaps(page, panel); showPose(page, fromReference()); view.ask(); };

// Run one request at a time; the buttons rest meanwhile, and a message says what is being done.
const during = async (text, request) => {
  if (page.busy) return undefined;
  await settle();
  page.busy = true; document.body.dataset.busy = "true"; status(text);
  try {
    const found = await request();
    status("");
    return found;
  } catch (error) {
    status(error.message, true);
    return undefined;
  } finally {
    page.busy = false; delete document.body.dataset.busy;
    if (stale) measure();
  }
};

const change = async (text, name, body) => {
  const found = await during(text, () => call(name, body));
  if (found) adopt(found.state);
  return found;
};

// --- Moves: shown at once, sent when they end ------------------------------------------------------------------------
let pending = null, timer = 0;
const moveTo = (index, to) => { page.poses[index] = to; showPose(page, fromReference()); view.ask(); measure(); };
const send = async (index) => {
  try { adopt((await call("place", { map: index, ...pose(index) })).state); } catch (error) { status(error.message, true); }
};
const settle = async () => {
  if (pending === null) return;
  const index = pending;
  pending = null; clearTimeout(timer);
  await send(index);
};
const nudge = (to) => {
  if (page.busy) return;
  if (page.fixed(page.selected)) { status(page.locked.has(page.selected) ? "the map is locked" : "the reference stays; make another map the reference to move it", true); return; }
  moveTo(page.selected, to);
  pending = page.selected; clearTimeout(timer); timer = setTimeout(settle, 350);
};

const select = async (index) => { await settle(); page.selected = index; page.walls = new Map(); $("verdict").hidden = true; if (page.solved) showSolved("The merge", page.solved); show(); measure(); };
const toggled = (set, index) => { if (!page[set].delete(index)) page[set].add(index); page.walls = new Map(); show(); measure(); };

const panel = {
  select,
  hide: (index) => toggled("hidden", index),
  lock: (index) => toggled("locked", index),
  reference: (index) => change("", "reference", { map: index }),
};

const view = new View($("canvas"), page, {
  select,
  move: moveTo,
  moved: send,
  painted: (milliseconds) => { page.frames.push(milliseconds); if (page.frames.length > 600) page.frames.shift(); scaleBar(); },
});

const scaleBar = () => {
  const unit = page.maps[page.reference]?.unit === "m" ? "m" : "cells", most = 110 / view.zoom, power = 10 ** Math.floor(Math.log10(most));
  const length = [5, 2, 1].map((factor) => factor * power).find((each) => each <= most) ?? power;
  $("bar").style.width = `${length * view.zoom}px`;
  $("bar").firstElementChild.textContent = `${Number(length.toPrecision(3))} ${unit}`;
};

// --- The tool ------------------------------------------------------------------------------------------------------------
const snap = async () => {
  if (page.locked.has(page.selected)) { status("the map is locked", true); return; }
  const found = await change("Snapping…", "snap", { map: page.selected, others: others() });
  if (found) showVerdict({ title: `Snap to ${page.maps[found.other].name}`, text: answerText(found.answer), advice: found.answer.try ?? "", evidence: found.answer.evidence });
};

const classesOf = (walls) => new Map(Object.entries(walls).map(([key, text]) => [Number(key), Uint8Array.from(atob(text), (each) => each.charCodeAt(0))]));

// Ask for the answer of the selected map and a given one, or of the one that fits best.
const askTool = async (given) => {
  const map = page.selected;
  const found = await during("Matching the pair…", async () => {
    const other = given ?? (await call("partner", { map, others: others() })).other;
    const record = await call("candidates", { map, other });
    const best = record.candidates.slice(0, MOST_CANDIDATES);
    const measured = await Promise.all(best.map(({ x, y, yaw, scale }) => call("measure", { map, x, y, yaw, scale, others: [other] })));
    return { ...record, candidates: best.map((each, number) => ({ ...each, ...measured[number].pairs[0], walls: classesOf(measured[number].walls) })) };
  });
  if (!found) return;
  const { other, answer } = found, percent = (share) => `${Math.round(100 * (share ?? 0))} %`;
  const choose = (number) => change("", "choose", { map, other, number });
  showVerdict({
    title: `Tool's answer against ${page.maps[other].name}`, text: answerText(answer), advice: answer.try ?? "", evidence: answer.evidence,
    candidates: found.candidates.map((each, number) => element("li", {}, element("button", { onclick: () => choose(number), disabled: page.locked.has(map), title: "Place the map so" },
      thumbnail(page, [[other, page.poses[other]], [map, each]], each.walls, 142, 104),
      element("b", {}, number ? `Runner-up ${number}` : "Best", element("span", {}, each.score.toFixed(2))),
      element("small", {}, `in common ${percent(each.overlap)}, in free space ${percent(each.violation)}`)))),
  });
  $("verdict").scrollIntoView({ block: "nearest" });
};

let texts = {};
const solve = async () => {
  const found = await change("Merging all maps…", "solve", {});
  if (!found) return;
  texts = found.exports;
  showSolved("Merged", found.state.solved);
};

const showSolved = (title, solved) => showVerdict({
  title, text: solved.left_out.length ? "" : "All maps are joined.",
  pairs: [...solved.left_out.map(({ name, reason }) => element("li", { class: "refused" }, element("b", {}, name), ` was left out: ${reason}`)), ...solved.pairs.map((pair) => pairItem(pair, () => explain(pair)))],
});

const explain = async ({ target, source }) => {
  const [other, map] = [target, source].map((name) => page.maps.findIndex((each) => each.name === name));
  await select(map); await askTool(other);
};

const save = async (asPlaced) => {
  $("saved").textContent = "Saving…";
  const found = await change("Saving…", "save", { as_placed: asPlaced, yaw_zero: $("yaw-zero").checked, frame_of: $("frame-of").value === "" ? null : Number($("frame-of").value) });
  $("saved").textContent = found ? `Written: ${found.files.join(", ")}` : $("status").textContent;
  if (!found) return;
  texts = found.exports;
  showSolved(asPlaced ? "Saved as placed" : "Saved", found.answer);
  $("exports").hidden = false; form("tf");
};

const form = (name) => {
  $("export").value = texts[name] ?? "";
  for (const tab of document.querySelectorAll("[role=tab]")) tab.setAttribute("aria-selected", String(tab.dataset.form === name));
};

// --- Buttons and keys -------------------------------------------------------------------------------------------------
$("undo").addEventListener("click", () => change("", "undo"));
$("redo").addEventListener("click", () => change("", "redo"));
$("fit").addEventListener("click", () => view.fit());
$("snap").addEventListener("click", snap);
$("ask").addEventListener("click", () => askTool());
$("solve").addEventListener("click", solve);
$("save").addEventListener("click", () => { $("saved").textContent = ""; $("save-dialog").showModal(); });
$("save-merge").addEventListener("click", () => save(false));
$("save-placed").addEventListener("click", () => save(true));
$("quit").addEventListener("click", async () => { if (await during("", () => call("quit"))) { document.body.dataset.ended = "true"; status("The page has ended; this window can be closed."); } });
for (const tab of document.querySelectorAll("[role=tab]")) tab.addEventListener("click", () => form(tab.dataset.form));
$("copy").addEventListener("click", () => navigator.clipboard.writeText($("export").value));

const fields = $("pose");
fields.addEventListener("input", () => {
  page.typing = true;
  const [x, y, yaw, scale] = ["x", "y", "yaw", "scale"].map((name) => fields[name].valueAsNumber);
  if (![x, y, yaw, scale].every(Number.isFinite) || scale <= 0 || page.selected === page.reference) return;
  nudge(compose(page.poses[page.reference], { x, y, yaw: (yaw * Math.PI) / 180, scale }));
});
fields.addEventListener("focusout", () => { page.typing = false; showPose(page, fromReference()); });
fields.addEventListener("submit", (event) => { event.preventDefault(); settle(); });

const theme = $("theme"), dark = () => (document.documentElement.dataset.theme ?? (matchMedia("(prefers-color-scheme: dark)").matches ? "dark" : "light")) === "dark";
const nameTheme = () => { theme.textContent = dark() ? "Light" : "Dark"; };
matchMedia("(prefers-color-scheme: dark)").addEventListener("change", nameTheme);
theme.addEventListener("click", () => { document.documentElement.dataset.theme = dark() ? "light" : "dark"; });
new MutationObserver(() => { nameTheme(); view.ask(); }).observe(document.documentElement, { attributeFilter: ["data-theme"] });

addEventListener("keydown", (event) => {
  if (event.target.closest("input, textarea, dialog") || (page.readOnly && event.key.toLowerCase() !== "f")) return;
  const command = event.ctrlKey || event.metaKey, key = event.key.toLowerCase();
  if (command) {
    if (key !== "z" && key !== "y") return;
    event.preventDefault(); (key === "y" || event.shiftKey ? $("redo") : $("undo")).click();
    return;
  }
  const now = page.poses[page.selected], many = event.shiftKey ? 10 : 1, step = many * page.maps[page.selected].resolution * now.scale;
  const turn = (degrees) => nudge(about(now, view.middle(page.selected), (many * degrees * Math.PI) / 180));
  const keys = {
    arrowleft: () => nudge(shifted(now, -step, 0)), arrowright: () => nudge(shifted(now, step, 0)),
    arrowup: () => nudge(shifted(now, 0, step)), arrowdown: () => nudge(shifted(now, 0, -step)),
    q: () => turn(0.5), e: () => turn(-0.5), s: snap, f: () => view.fit(),
    "[": () => page.scaleFixed || nudge(about(now, view.middle(page.selected), 0, 1 / 1.01)),
    "]": () => page.scaleFixed || nudge(about(now, view.middle(page.selected), 0, 1.01)),
  };
  if (keys[key]) { event.preventDefault(); keys[key](); }
});

// Take away all that needs the server.
const readOnly = () => {
  for (const each of document.querySelectorAll("[data-served]")) each.remove();
  document.body.dataset.readOnly = "true";
  $("hint").textContent = "Drag to pan. After a click, the wheel zooms.";
  $("canvas").setAttribute("aria-label", "Maps over one another, as the merge placed them. Drag to pan.");
};

// --- Start ---------------------------------------------------------------------------------------------------------------
const start = async () => {
  status("Loading the maps…");
  const record = await getJson("start");
  page.maps = await Promise.all(record.maps.map(async (map, index) => {
    const [cells, walls] = await Promise.all([getBytes(`maps/${index}/cells`), getBytes(`maps/${index}/walls`)]);
    const [x, y, yaw] = map.origin;
    return { ...map, frame: { x, y, yaw, scale: 1 }, raster: new Raster(new Uint8Array(cells), map.rows, map.cols), points: new Float32Array(walls) };
  }));
  page.scaleFixed = record.scale_fixed; page.selected = page.maps.findIndex((_, index) => index !== record.state.reference || page.maps.length === 1);
  page.readOnly = record.read_only ?? false; page.solved = record.solved ?? null;
  if (page.readOnly) readOnly(); else {
    $("out").textContent = record.out;
    $("frame-of").replaceChildren(element("option", { value: "" }, "no map"), ...page.maps.map(({ name }, index) => element("option", { value: String(index) }, name)));
  }
  if (page.solved) showSolved("The merge", page.solved);
  status(""); nameTheme(); adopt(record.state); view.fit();
  window.mapquilt = { page, view };
  document.body.dataset.ready = "true";
};
start().catch((error) => status(error.message, true));
