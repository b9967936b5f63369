// Answers of the page inside a report, where there is no server: all of them were computed when the report was written.

import { compose, inverse } from "./geometry.js";

const NEAR = 1e-6;

const bytes = (text) => Uint8Array.from(atob(text), (each) => each.charCodeAt(0));

const unpacked = async (text) =>
  JSON.parse(await new Response(new Blob([bytes(text)]).stream().pipeThrough(new DecompressionStream("deflate"))).text());

const data = unpacked(document.getElementById("data").textContent);
const history = { past: [], now: null, future: [] };

export const getJson = async (name) => {
  const { [name]: record } = await data;
  history.now ??= record.state.placements;
  return record;
};

export const getBytes = async (name) => {
  const [, index, kind] = name.split("/");
  return bytes((await data)[kind][index]).buffer;
};

// The record of two maps in either order: the one of the later map on the earlier one, or its inverse.
const pairOf = ({ pairs }, map, other) => pairs.find((pair) => pair.map === Math.max(map, other) && pair.other === Math.min(map, other));
const directed = (pair, map, pose) => (pair.map === map ? pose : inverse(pose));
const same = (a, b) => ["x", "y", "yaw", "scale"].every((name) => Math.abs(a[name] - b[name]) < NEAR);

// A match decides on a wall, then a contradiction, as where the walls of several pairs are combined for the server's page.
const combined = (all) => all[0].map((_, k) => (all.some((classes) => classes[k] === 1) ? 1 : all.some((classes) => classes[k] === 2) ? 2 : 0));
const text = (classes) => btoa(Array.from(classes, (each) => String.fromCharCode(each)).join(""));

const calls = {
  measure: (record, { map, others, ...pose }) => {
    const found = others.flatMap((other) => {
      const pair = pairOf(record, map, other), place = directed(pair, map, compose(inverse(history.now[other]), pose));
      const measured = pair.measured.find((each) => same(each.place, place));
      return measured ? [{ ...measured, other }] : [];
    });
    const walls = Object.fromEntries(found.map((each) => [each.other, each.walls[each.other]]));
    if (found.length) walls[map] = text(combined(found.map((each) => bytes(each.walls[map]))));
    return { pairs: found.map(({ pairs: [scores], other }) => ({ ...scores, other })), walls };
  },
  partner: (record, { map, others }) => {
    const rank = ({ answer, candidates }) => [Number(answer.accepted), candidates[0]?.score ?? 0];
    const asked = others.map((other) => [other, pairOf(record, map, other)]).filter(([, pair]) => pair.answer).map(([other, pair]) => ({ other, rank: rank(pair) }));
    if (!asked.length) throw new Error("the merge did not compare this map with a visible one");
    return asked.sort((a, b) => b.rank[0] - a.rank[0] || b.rank[1] - a.rank[1])[0];
  },
  candidates: (record, { map, other }) => {
    const pair = pairOf(record, map, other);
    if (!pair.answer) throw new Error("the merge did not compare these maps");
    const places = pair.candidates.map(({ score, ...place }) => ({ ...compose(history.now[other], directed(pair, map, place)), score }));
    return { map, other, answer: pair.answer, candidates: places };
  },
  choose: (record, { map, other, number }) => {
    const { score, ...pose } = calls.candidates(record, { map, other }).candidates[number];
    history.past.push(history.now); history.future = [];
    history.now = history.now.map((each, index) => (index === map ? { ...pose, decided_by: "choice" } : each));
    return state(record);
  },
  undo: (record) => { if (history.past.length) { history.future.push(history.now); history.now = history.past.pop(); } return state(record); },
  redo: (record) => { if (history.future.length) { history.past.push(history.now); history.now = history.future.pop(); } return state(record); },
};

const state = ({ start }) => ({ state: { ...start.state, placements: history.now, undo: history.past.length > 0, redo: history.future.length > 0 } });

export const call = async (name, body = {}) => calls[name](await data, body);
