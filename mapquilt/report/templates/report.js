"use strict";
(() => {
  const read = (id) => JSON.parse(document.getElementById(id).textContent);
  const images = read("images"), shown = read("shown"), facts = read("facts");
  const $ = (selector, from = document) => from.querySelector(selector);
  const $$ = (selector, from = document) => [...from.querySelectorAll(selector)];

  // Light, dark, or what the system says.
  const root = document.documentElement, theme = $("#theme");
  const isDark = () => root.dataset.theme ? root.dataset.theme === "dark" : matchMedia("(prefers-color-scheme: dark)").matches;
  const label = () => { theme.textContent = isDark() ? "Light" : "Dark"; };
  const maps = $("#maps-page"), dressMaps = () => { if (root.dataset.theme) maps.contentDocument.documentElement.dataset.theme = root.dataset.theme; };
  theme.addEventListener("click", () => { root.dataset.theme = isDark() ? "light" : "dark"; label(); if (maps) dressMaps(); });
  if (maps) maps.addEventListener("load", dressMaps);
  label();

  const table = $("#pairs"), body = $("tbody", table);
  const rows = $$("tr", body), visible = () => $$("tr:not([hidden])", body);

  // Sorting: numbers by their full value, what is missing always last.
  const key = (row, column) => row.cells[column].dataset.key ?? row.cells[column].textContent;
  const compare = (a, b) => {
    if (a === "" || b === "") return (a === "") - (b === "");
    const x = Number(a), y = Number(b);
    return Number.isNaN(x) || Number.isNaN(y) ? a.localeCompare(b, undefined, { numeric: true }) : x - y;
  };
  $$("thead th", table).forEach((head, column) => {
    $("button", head).addEventListener("click", () => {
      const down = head.getAttribute("aria-sort") === "ascending";
      $$("thead th", table).forEach((other) => other.removeAttribute("aria-sort"));
      head.setAttribute("aria-sort", down ? "descending" : "ascending");
      const missing = (row) => key(row, column) === "";
      const sorted = rows.map((row, index) => [row, index]).sort(([a, i], [b, j]) => {
        const order = compare(key(a, column), key(b, column));
        return (down && !missing(a) && !missing(b) ? -order : order) || i - j;
      });
      body.append(...sorted.map(([row]) => row));
    });
  });

  // Filtering: every word of the search, and every choice.
  const filters = $("#filters"), count = $("#count");
  const filter = () => {
    const words = $("#search").value.toLowerCase().split(/\s+/).filter(Boolean);
    const chosen = $$("select", filters).map((select) => [select.name, select.value]).filter(([, value]) => value !== "");
    for (const row of rows) {
      row.hidden = !(words.every((word) => row.dataset.words.includes(word)) && chosen.every(([name, value]) => row.dataset[name] === value));
    }
    const now = visible().length;
    count.textContent = now === rows.length ? `${rows.length} rows` : `${now} of ${rows.length} rows`;
  };
  for (const kind of ["input", "change"]) filters.addEventListener(kind, filter);
  filters.addEventListener("submit", (event) => event.preventDefault());
  filter();

  // Small pictures are set when they come into view.
  const thumbs = new IntersectionObserver((entries) => {
    for (const { isIntersecting, target } of entries) {
      if (!isIntersecting) continue;
      target.src = images[Number(target.dataset.image)];
      thumbs.unobserve(target);
    }
  }, { rootMargin: "300px" });
  $$("img.thumb").forEach((image) => thumbs.observe(image));

  // One pair, large.
  const dialog = $("#pair"), overlay = $(".overlay", dialog), slider = $("#slider");
  let current = null;
  const cut = () => {
    overlay.style.setProperty("--cut", `${slider.value}%`);
    slider.setAttribute("aria-valuetext", `${slider.value} % merge, ${100 - slider.value} % truth`);
  };
  slider.addEventListener("input", cut);
  const set = (selector, image, alt) => {
    const element = $(selector, dialog);
    element.hidden = image === null;
    if (image === null) { element.removeAttribute("src"); element.alt = ""; } else { element.src = images[image]; element.alt = alt; }
  };
  const show = (row) => {
    const number = row.dataset.number, fact = facts[number], pictures = shown[number];
    current = row;
    $("#pair-title").textContent = fact.method ? `${fact.title}, ${fact.method}` : fact.title;
    const list = $(".facts", dialog);
    list.replaceChildren(...fact.facts.flatMap(([name, value]) => {
      const term = document.createElement("dt"), text = document.createElement("dd");
      term.textContent = name; text.textContent = value;
      if (name === "outcome") text.className = fact.outcome.replace(" ", "-");
      return [term, text];
    }));
    const both = pictures.answer !== null && pictures.truth !== null;
    const under = pictures.truth ?? pictures.answer;
    set(".under", under, pictures.truth !== null ? "The source's walls in orange over the target's in blue, where they truly lie" : "The source's walls in orange over the target's in blue, where the merge puts them");
    set(".over", both ? pictures.answer : null, "The source's walls in orange over the target's in blue, where the merge puts them");
    set(".target", pictures.target, `Target map of ${fact.title}`);
    set(".source", pictures.source, `Source map of ${fact.title}`);
    set(".alternative img", pictures.alternative, "The source over the target at the second-best placement");
    $(".alternative", dialog).hidden = pictures.alternative === null;
    for (const part of $$(".both", dialog)) part.hidden = !both;
    overlay.hidden = under === null;
    const alone = $("#alone", dialog);
    alone.hidden = both;
    alone.textContent = fact.negative ? "These maps have no common ground: no transform is right." + (under === null ? "" : " Shown is what the merge proposes.") : fact.outcome === "not merged" ? "Not merged yet; shown is the truth." : pictures.answer === null ? "No transform was proposed; shown is the truth." : "";
    slider.value = 50; cut();
    $("#link").href = `#${row.id}`;
    history.replaceState(null, "", `#${row.id}`);
    const list_of_rows = visible().filter((one) => one.dataset.number in shown), at = list_of_rows.indexOf(row);
    $("#previous").disabled = at <= 0; $("#next").disabled = at < 0 || at === list_of_rows.length - 1;
    if (!dialog.open) dialog.showModal();
  };
  const step = (by) => {
    const drawn = visible().filter((row) => row.dataset.number in shown), next = drawn[drawn.indexOf(current) + by];
    if (next) show(next);
  };
  body.addEventListener("click", (event) => {
    const button = event.target.closest("button.open");
    if (button) show(button.closest("tr"));
  });
  $("#previous").addEventListener("click", () => step(-1));
  $("#next").addEventListener("click", () => step(1));
  $("#close").addEventListener("click", () => dialog.close());
  dialog.addEventListener("click", (event) => { if (event.target === dialog) dialog.close(); });
  dialog.addEventListener("keydown", (event) => {
    if (event.target === slider) return;
    if (event.key === "ArrowRight") step(1);
    if (event.key === "ArrowLeft") step(-1);
  });
  dialog.addEventListener("close", () => {
    history.replaceState(null, "", location.pathname + location.search);
    if (current) $("button.open", current).focus();
  });

  // A link to a pair opens it.
  const follow = () => {
    const row = rows.find((one) => one.id === decodeURIComponent(location.hash.slice(1)));
    if (!row || (dialog.open && row === current)) return;
    if (row.dataset.number in shown) show(row); else row.scrollIntoView({ block: "center" });
  };
  addEventListener("hashchange", follow);
  follow();
})();
