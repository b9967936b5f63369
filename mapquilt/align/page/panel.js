// The panel beside the canvas. All names come from files, so they are only ever set as text.

export const $ = (id) => document.getElementById(id);

export const element = (tag, attributes = {}, ...children) => {
  const made = document.createElement(tag);
  for (const [name, value] of Object.entries(attributes)) {
    if (name.startsWith("on")) made.addEventListener(name.slice(2), value);
    else if (value === true) made.setAttribute(name, "");
    else if (value !== false && value !== null) made.setAttribute(name, value);
  }
  made.append(...children);
  return made;
};

const DECIDED = {
  start: "not placed yet", hand: "placed by hand", snap: "snapped", choice: "placed at a candidate that you chose", automatic: "placed by the merger",
};

export const decidedText = (kind) => DECIDED[kind];

export const showMaps = (page, on) => {
  $("maps").replaceChildren(...page.maps.map((map, index) => {
    const toggle = (set, shown, hidden, action) => element("button", {
      class: "toggle", "aria-pressed": String(page[set].has(index)), title: `${page[set].has(index) ? hidden : shown}: ${map.name}`, onclick: () => action(index),
    }, page[set].has(index) ? hidden : shown);
    const reference = element("button", {
      class: "toggle reference", "aria-pressed": String(page.reference === index), title: "The answer is in the frame of this map", onclick: () => on.reference(index),
    }, page.reference === index ? "reference" : "make reference");
    const swatch = element("i");
    swatch.style.background = map.colour;
    return element("li", { class: index === page.selected ? "selected" : false },
      element("button", { class: "name", "aria-pressed": String(index === page.selected), onclick: () => on.select(index) }, swatch, element("span", {}, map.name)),
      element("div", {}, toggle("hidden", "hide", "show", on.hide), ...(page.readOnly ? [] : [toggle("locked", "lock", "unlock", on.lock), reference])));
  }));
};

export const showPose = (page, fromReference) => {
  const map = page.maps[page.selected], form = $("pose");
  $("selected-name").textContent = map.name;
  $("decided").textContent = page.selected === page.reference ? "reference of the answer" : decidedText(page.decided[page.selected]);
  const unit = page.maps[page.reference].unit === "m" ? "[m]" : "[cells]";
  $("unit-x").textContent = unit; $("unit-y").textContent = unit;
  $("scale-label").hidden = page.scaleFixed;
  const fixed = (value, places) => (Math.round(value * 10 ** places) / 10 ** places + 0).toFixed(places);  // no -0.00
  const values = { x: fixed(fromReference.x, 3), y: fixed(fromReference.y, 3), yaw: fixed((fromReference.yaw * 180) / Math.PI, 2), scale: fixed(fromReference.scale, 4) };
  for (const [name, value] of Object.entries(values)) if (document.activeElement !== form[name] || !page.typing) form[name].value = value;
  for (const name of Object.keys(values)) form[name].disabled = page.readOnly || page.selected === page.reference || page.locked.has(page.selected);
};

const bar = (label, share, kind) => {
  const filled = element("i", { class: kind });
  filled.style.width = `${Math.round(100 * (share ?? 0))}%`;
  return element("div", { class: "bar" }, element("span", {}, label), element("div", {}, filled), element("b", {}, share === null ? "–" : `${Math.round(100 * share)} %`));
};

export const showScores = (page, pairs) => {
  $("scores").replaceChildren(...[...pairs].sort((a, b) => b.score - a.score).map((pair) => element("div", { class: "score" },
    element("p", {}, "against ", element("b", {}, page.maps[pair.other].name), element("span", { class: "number" }, `score ${pair.score.toFixed(2)}`)),
    bar("walls in common", pair.overlap, "good"), bar("agreement", pair.agreement, "good"), bar("walls in free space", pair.violation, "bad"))));
};

export const showVerdict = ({ title, text = "", advice = "", evidence = [], candidates = [], pairs = [] }) => {
  $("verdict").hidden = false;
  $("verdict-title").textContent = title;
  $("verdict-text").textContent = text;
  $("verdict-try").textContent = advice ? `Try: ${advice}` : "";
  $("evidence").replaceChildren(...evidence.map(evidenceRow)); $("evidence").parentElement.hidden = !evidence.length;
  $("candidates").replaceChildren(...candidates);
  $("pairs").replaceChildren(...pairs);
};

const number = (value) => (value >= 100 ? value.toFixed(0) : value.toFixed(2));

const evidenceRow = ({ title, value, least }) => element("tr", { class: value < least ? "missing" : false },
  element("td", {}, title), element("td", {}, number(value)), element("td", {}, number(least)));

export const answerText = (answer) => {
  const sure = `confidence ${answer.confidence.toFixed(2)}`;
  return answer.accepted ? `Accepted, ${sure}.` : `Refused: ${answer.reason ?? "no reason"} (${sure}).`;
};

export const pairItem = (answer, explain) => element("li", { class: answer.accepted ? "accepted" : "refused" },
  element("button", { class: "pair", title: "Show the evidence and the candidates", onclick: explain }, `${answer.target} – ${answer.source}`), ` ${answerText(answer)}`);

export const status = (text, bad = false) => { $("status").textContent = text; $("status").classList.toggle("bad", bad); };
