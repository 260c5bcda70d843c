"use strict";
// A session of two-alternative forced choice: one participant, one list, an answer a pair. A plain script, as pages that are
// opened as files may load no modules. The session is stored in the browser after each step, so a reloaded page goes on.

/**
 * seen: how often a pair was shown before its answer; gone: the pictures had disappeared by then.
 * @typedef {"left" | "right"} Side
 * @typedef {{ item: string, left: string, right: string, choice: Side, ms: number, gone: boolean, seen: number }} Answer
 * @typedef {{ width: number, height: number, pixel_ratio: number, picture: number }} ScreenSize
 * @typedef {{ participant: string, list: number, screen: ScreenSize | null, seen: number, answers: Answer[] }} Session
 */

const PAUSE = 400; // milliseconds without pictures before each pair
/** @type {Record<string, Side>} */
const KEYS = { ArrowLeft: "left", KeyF: "left", ArrowRight: "right", KeyJ: "right" };
const STORAGE_KEY = `davgswt-2afc-${STUDY.study}`;

/** @type {Session | null} */
let session = null;
/** @type {{ since: number, gone: boolean } | null} */
let current = null; // the pair on the screen; null between pairs
let timer = 0;

/** An element of index.html. @param {string} id @returns {HTMLElement} */
const element = (id) => /** @type {HTMLElement} */ (document.getElementById(id));
/** @param {string} id */
const image = (id) => /** @type {HTMLImageElement} */ (element(id));
const consent = /** @type {HTMLInputElement} */ (element("consent"));
const beginButton = /** @type {HTMLButtonElement} */ (element("begin"));

/** @returns {Session | null} */
function readSession() {
  try {
    const value = JSON.parse(localStorage.getItem(STORAGE_KEY) ?? "null");
    return value && STUDY.lists[value.list] && Array.isArray(value.answers) ? value : null;
  } catch {
    return null; // no storage here: a reloaded page begins anew
  }
}

function writeSession() {
  try {
    if (session) localStorage.setItem(STORAGE_KEY, JSON.stringify(session));
    else localStorage.removeItem(STORAGE_KEY);
  } catch {} // as above
}

/** @param {number} bytes */
const randomHex = (bytes) => [...crypto.getRandomValues(new Uint8Array(bytes))].map((b) => b.toString(16).padStart(2, "0")).join("");
/** @param {Session} session */
const trialsOf = ({ list }) => STUDY.lists[list];

/** The list of ?list=n, so that lists can be dealt in turn; else a random one. */
function chooseList() {
  const asked = new URLSearchParams(location.search).get("list");
  if (asked !== null && /^\d{1,4}$/.test(asked) && STUDY.lists[Number(asked)]) return Number(asked);
  return crypto.getRandomValues(new Uint32Array(1))[0] % STUDY.lists.length;
}

/** @param {string | null} id */
function showSection(id) {
  for (const section of ["intro", "trial", "end"]) element(section).hidden = section !== id;
}

function begin() {
  session = { participant: randomHex(16), list: chooseList(), screen: null, seen: 0, answers: [] };
  writeSession();
  next();
}

/** @param {string} name */
const pictureFile = (name) => `pictures/${name}.png`;

async function next() {
  if (!session) return;
  current = null;
  const mine = session, trials = trialsOf(mine), number = mine.answers.length;
  /** @type {HTMLProgressElement} */ (element("bar")).value = number / trials.length;
  if (number === trials.length) return finish();
  showSection("trial");
  element("pair").className = "away";
  element("question").textContent = "\u00a0";
  element("number").textContent = `${number + 1} of ${trials.length}`;
  const [, left, right] = trials[number];
  const pictures = [image("leftPicture"), image("rightPicture")];
  [pictures[0].src, pictures[1].src] = [pictureFile(left), pictureFile(right)];
  try {
    await Promise.all([...pictures.map((picture) => picture.decode()), new Promise((done) => setTimeout(done, PAUSE))]);
  } catch {
    return fail("A picture is missing from the page's folder. Please tell whoever asked you to take part.");
  }
  if (session === mine) showPair(mine);
}

/** @param {Session} mine */
function showPair(mine) {
  mine.seen += 1;
  mine.screen = {
    width: screen.width, height: screen.height, pixel_ratio: devicePixelRatio,
    picture: image("leftPicture").getBoundingClientRect().width,
  };
  writeSession();
  element("pair").className = "";
  element("question").textContent = "Which one has the less visible seam?";
  requestAnimationFrame((now) => {
    if (session !== mine) return;
    const pair = { since: now, gone: false };
    current = pair;
    timer = setTimeout(() => {
      element("pair").className = "away";
      pair.gone = true;
    }, 1000 * STUDY.seconds);
  });
}

/** @param {Side} choice */
function answer(choice) {
  if (!current || !session) return;
  clearTimeout(timer);
  const [item, left, right] = trialsOf(session)[session.answers.length];
  const ms = Math.round(Math.max(0, performance.now() - current.since));
  session.answers.push({ item, left, right, choice, ms, gone: current.gone, seen: session.seen });
  session.seen = 0;
  writeSession();
  next();
}

function finish() {
  showSection("end");
  element("saved").textContent = "";
}

function save() {
  if (!session) return;
  const { participant, list, screen, answers } = session;
  const saved = { format: "davgswt-2afc", version: 1, study: STUDY.study, participant, list, consent: true, screen, answers };
  const link = document.createElement("a");
  link.href = URL.createObjectURL(new Blob([`${JSON.stringify(saved, null, 1)}\n`], { type: "application/json" }));
  link.download = `2afc_${participant}.json`;
  link.click();
  setTimeout(() => URL.revokeObjectURL(link.href), 60000);
  element("saved").textContent = `Saved as ${link.download}.`;
}

function forget() {
  clearTimeout(timer);
  session = current = null;
  writeSession();
  welcome();
}

function welcome() {
  const before = readSession();
  if (before && before.answers.length === trialsOf(before).length) {
    session = before;
    return finish();
  }
  const count = STUDY.lists[0].length;
  element("seconds").textContent = String(STUDY.seconds);
  element("count").textContent = String(count);
  element("minutes").textContent = String(Math.max(1, Math.ceil((count * (STUDY.seconds + 1)) / 60)));
  consent.checked = false;
  beginButton.disabled = true;
  element("goOn").hidden = !before;
  element("consentLine").hidden = beginButton.hidden = Boolean(before);
  if (before) element("done").textContent = String(before.answers.length);
  showSection("intro");
}

/** @param {string} message */
function fail(message) {
  showSection(null);
  element("error").textContent = message;
  element("error").hidden = false;
}

consent.addEventListener("change", () => {
  beginButton.disabled = !consent.checked;
});
beginButton.addEventListener("click", begin);
element("resume").addEventListener("click", () => {
  session = readSession();
  next();
});
for (const id of ["afresh", "stop", "next"]) element(id).addEventListener("click", forget);
element("save").addEventListener("click", save);
for (const side of /** @type {Side[]} */ (["left", "right"])) element(side).addEventListener("click", () => answer(side));
addEventListener("keydown", (event) => {
  if (event.repeat || event.ctrlKey || event.metaKey || event.altKey || !KEYS[event.code] || element("trial").hidden) return;
  event.preventDefault();
  answer(KEYS[event.code]);
});
welcome();
