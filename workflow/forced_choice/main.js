"use strict";
// A session of trials: one person, one list, an answer a pair. A plain script, as pages that are opened as files may load no modules.
// What is known is written to the browser's own storage after each step, so that a page that is loaded again goes on.

const PAUSE = 400; // milliseconds without pictures before each pair
const KEYS = { ArrowLeft: "left", KeyF: "left", ArrowRight: "right", KeyJ: "right" };
const at = (id) => document.getElementById(id);
const place = `davgswt-2afc-${STUDY.study}`;

let session = null; // {participant, list, screen, seen, answers}; `seen`: how often the next pair was shown so far
let shown = null; // of the pair that is asked for: when it appeared, whether it went; null between pairs
let timer = 0;

function stored() {
  try {
    const found = JSON.parse(localStorage.getItem(place));
    return found && STUDY.lists[found.list] && Array.isArray(found.answers) ? found : null;
  } catch {
    return null; // no storage here: a page that is loaded again begins anew
  }
}

function store() {
  try {
    if (session) localStorage.setItem(place, JSON.stringify(session));
    else localStorage.removeItem(place);
  } catch {} // as above
}

const hex = (bytes) => [...crypto.getRandomValues(new Uint8Array(bytes))].map((b) => b.toString(16).padStart(2, "0")).join("");
const trials = () => STUDY.lists[session.list];

/** The list of ?list=n, so that lists can be dealt in turn; else any. */
function listFor() {
  const asked = new URLSearchParams(location.search).get("list");
  if (/^\d{1,4}$/.test(asked ?? "") && STUDY.lists[asked]) return Number(asked);
  return crypto.getRandomValues(new Uint32Array(1))[0] % STUDY.lists.length;
}

function show(id) {
  for (const section of ["intro", "trial", "end"]) at(section).hidden = section !== id;
}

function begin() {
  session = { participant: hex(16), list: listFor(), screen: null, seen: 0, answers: [] };
  store();
  next();
}

const source = (name) => `pictures/${name}.png`;

async function next() {
  shown = null;
  const number = session.answers.length, count = trials().length, mine = session;
  at("bar").value = number / count;
  if (number === count) return finish();
  show("trial");
  at("pair").className = "away";
  at("question").textContent = "\u00a0";
  at("number").textContent = `${number + 1} of ${count}`;
  const [, left, right] = trials()[number];
  const pictures = [at("leftPicture"), at("rightPicture")];
  [pictures[0].src, pictures[1].src] = [source(left), source(right)];
  try {
    await Promise.all([...pictures.map((picture) => picture.decode()), new Promise((done) => setTimeout(done, PAUSE))]);
  } catch {
    return fail("A picture is missing from the page's folder. Please tell whoever asked you to take part.");
  }
  if (session === mine) appear();
}

function appear() {
  session.seen += 1;
  session.screen = {
    width: screen.width, height: screen.height, pixel_ratio: devicePixelRatio, picture: at("leftPicture").getBoundingClientRect().width,
  };
  store();
  at("pair").className = "";
  at("question").textContent = "Which one has the less visible seam?";
  const mine = session;
  requestAnimationFrame((now) => {
    if (session !== mine) return;
    shown = { since: now, gone: false };
    timer = setTimeout(() => {
      at("pair").className = "away";
      shown.gone = true;
    }, 1000 * STUDY.seconds);
  });
}

function answer(choice) {
  if (!shown) return;
  clearTimeout(timer);
  const [item, left, right] = trials()[session.answers.length];
  const ms = Math.round(Math.max(0, performance.now() - shown.since));
  session.answers.push({ item, left, right, choice, ms, gone: shown.gone, seen: session.seen });
  session.seen = 0;
  store();
  next();
}

function finish() {
  show("end");
  at("saved").textContent = "";
}

function save() {
  const { participant, list, screen, answers } = session;
  const told = { format: "davgswt-2afc", version: 1, study: STUDY.study, participant, list, consent: true, screen, answers };
  const link = document.createElement("a");
  link.href = URL.createObjectURL(new Blob([`${JSON.stringify(told, null, 1)}\n`], { type: "application/json" }));
  link.download = `2afc_${participant}.json`;
  link.click();
  setTimeout(() => URL.revokeObjectURL(link.href), 60000);
  at("saved").textContent = `Saved as ${link.download}.`;
}

function forget() {
  clearTimeout(timer);
  session = shown = null;
  store();
  welcome();
}

function welcome() {
  const found = stored();
  if (found && found.answers.length === STUDY.lists[found.list].length) {
    session = found;
    return finish();
  }
  const count = STUDY.lists[0].length;
  at("seconds").textContent = STUDY.seconds;
  at("count").textContent = count;
  at("minutes").textContent = Math.max(1, Math.ceil((count * (STUDY.seconds + 1)) / 60));
  at("consent").checked = false;
  at("begin").disabled = true;
  at("goOn").hidden = !found;
  at("consentLine").hidden = at("begin").hidden = Boolean(found);
  if (found) at("done").textContent = found.answers.length;
  show("intro");
}

function fail(said) {
  show(null);
  at("error").textContent = said;
  at("error").hidden = false;
}

at("consent").addEventListener("change", () => { at("begin").disabled = !at("consent").checked; });
at("begin").addEventListener("click", begin);
at("resume").addEventListener("click", () => { session = stored(); next(); });
for (const id of ["afresh", "stop", "next"]) at(id).addEventListener("click", forget);
at("save").addEventListener("click", save);
for (const side of ["left", "right"]) at(side).addEventListener("click", () => answer(side));
addEventListener("keydown", (event) => {
  if (event.repeat || event.ctrlKey || event.metaKey || event.altKey || !KEYS[event.code] || at("trial").hidden) return;
  event.preventDefault();
  answer(KEYS[event.code]);
});
welcome();
