// The panel: status, what is asked for, actuators, travel and working modes.
const $ = (selector) => document.querySelector(selector);
function made(tag, properties = {}, ...inside) {
  const element = Object.assign(document.createElement(tag), properties);
  element.append(...inside);
  return element;
}
const chip = (text, className = "") => made("span", { className: `chip ${className}`, textContent: text });
const MOST_CHIPS = 5;
const NEARLY = 0.005;
const MEANINGS = {
  serial: "platform speed per actuator speed, at least; 0 at a dead point of a leg",
  parallel: "actuator speed per platform speed, at least; 0 where locked actuators hold nothing",
};

/** Numbers as the panel shows them: small machines in metres are shown in millimetres. */
class Wording {
  constructor({ unit: name, length }) {
    this.factor = name === "m" && length < 1 ? 1000 : 1;
    this.unit = this.factor > 1 ? "mm" : name;
    this.digits = this.unit === "m" ? 3 : 1;
  }

  length(value) {
    return rounded(value * this.factor, this.digits);
  }

  /** The speed of drives that are all alike; null where they are not. */
  speed(speeds, drives) {
    const { isAngle } = drives[0];
    const isAlike = speeds.every((speed, k) => Math.abs(speed - speeds[0]) < 1e-6 * speeds[0] && drives[k].isAngle === isAngle);
    return isAlike ? `${this.value(speeds[0], isAngle)}${isAngle ? "" : ` ${this.unit}`}/s` : null;
  }

  value(value, isAngle) {
    return isAngle ? `${rounded(value / DEGREE, 1)}°` : this.length(value);
  }
}
const rounded = (value, digits) => (Math.abs(value) < 0.5 * 10 ** -digits ? 0 : value).toFixed(digits).replace("-", "−");

class Panel {
  constructor(machine, session) {
    Object.assign(this, { machine, session, wording: new Wording(machine) });
    const { slides, turns } = machine.task;
    this.addFields([...slides, ...turns.map((axis) => 3 + axis)]);
    this.addRows();
    this.addTabs();
    const units = [slides.length ? this.wording.unit : "", turns.length ? "degrees" : ""].filter(Boolean);
    $("#units").textContent = units.join(", ");
  }

  addFields(places) {
    const names = ["x", "y", "z", "roll", "pitch", "yaw"];
    this.fields = places.map((k) => {
      const step = k < 3 ? 10 ** (1 - this.wording.digits) : 1;
      const input = made("input", { type: "number", step, ariaLabel: names[k] });
      input.oninput = () => input.value !== "" && this.askFor(k, Number(input.value));
      input.onblur = () => this.showFields();
      $("#fields").append(made("label", {}, made("i", { className: "xyz"[k % 3], textContent: names[k] }), input));
      return { k, input };
    });
  }

  askFor(k, value) {
    const { target } = this.session;
    const [position, angles] = [originOf(target), anglesOf(target)];
    if (k < 3) position[k] = value / this.wording.factor;
    else angles[k - 3] = value;
    this.session.ask(poseOf(position, angles), { gesture: `field ${k}` });
  }

  /** Sliders of the actuators, and of passive joints in series that carry the end effector. */
  addRows() {
    const { actuators, series } = this.machine;
    this.rows = actuators.map((each, k) => this.addRow("#actuators", each, (value) => this.drive(k, value)));
    this.jointRows = (series?.coordinates ?? []).map((each, k) => this.addRow("#joints", each, (value) => this.driveJoint(k, value)));
    $("#joints").hidden = !series;
    for (const [id, all] of [["#actuators", actuators], ["#joints", series?.coordinates ?? []]])
      $(id).classList.toggle("wide", all.some(({ name }) => name.length > 8));
  }

  addRow(id, { name, isAngle, low, high, home }, ask) {
    const span = isAngle ? Math.PI : this.machine.length;
    const [min, max] = [low ?? home - span, high ?? home + span];
    const input = made("input", { type: "range", ariaLabel: name });
    Object.assign(input, { min, max, step: (max - min) / 4000 });
    input.oninput = () => ask(Number(input.value));
    const ends = [low, high].map((end) => (end === null ? "free" : this.wording.value(end, isAngle)));
    const text = made("output");
    const wish = made("i", { className: "wish", hidden: true });
    const slider = made("span", { className: "slider" }, input, wish);
    const row = made("div", { className: "row", title: `${name}: ${ends.join(" to ")}` }, made("span", { textContent: name }), slider, text);
    $(`${id} div`).append(row);
    return { row, input, text, wish, min, max };
  }

  drive(k, value) {
    const { answer, wished, start, engine } = this.session;
    const last = wished ?? answer.actuators ?? start?.actuators ?? engine.home.actuators;
    const values = last.map((each, i) => (i === k ? value : (answer.actuators?.[i] ?? each)));
    this.session.assemble(values, `actuator ${k}`);
  }

  driveJoint(k, value) {
    const values = (this.session.joints ?? this.joints).map((each, i) => (i === k ? value : each));
    this.session.askJoints(values, `joint ${k}`);
  }

  /** Where the joints in series are in the answer. */
  get joints() {
    return this.machine.series.coordinates.map(({ home, column }) => home + this.session.answer.q[column]);
  }

  addTabs() {
    const tabs = {
      pose: "Pose", joints: "Joints", actuators: "Actuators", near: "Singularity", travel: "Travel", close: "Limits",
      modes: "Modes", show: "Show",
    };
    const open = (name) => {
      for (const each of Object.keys(tabs)) {
        $(`#${each}`).classList.toggle("shown", each === name);
        $(`#${each}-tab`).setAttribute("aria-selected", each === name);
      }
    };
    for (const [name, textContent] of Object.entries(tabs)) {
      const button = made("button", { id: `${name}-tab`, textContent, onclick: () => open(name) });
      button.setAttribute("role", "tab");
      button.setAttribute("aria-controls", name);
      button.hidden = $(`#${name}`).hidden;
      $("nav").append(button);
    }
    open("actuators");
  }

  show() {
    const { answer } = this.session;
    if (answer.status !== PROJECTED || answer.limits.length) this.reason = "";
    this.showStatus();
    this.showFields();
    this.showActuators();
  }

  showStatus() {
    const { answer, isFar } = this.session;
    const words = {
      [REACHED]: "Reached", [PROJECTED]: "Out of reach", [EXCEEDED]: "Beyond its limits", [FAILED]: "No feasible pose found",
      [INVALID]: "Not a pose",
    };
    $("#status").className = isFar ? "far" : "reached";
    $("#status b").textContent = answer.isOnItsWay ? "On its way" : words[answer.status] ?? words[PROJECTED];
    $("#status p").textContent = this.explanation();
    const { limits } = answer;
    const shown = limits.slice(0, limits.length > MOST_CHIPS ? MOST_CHIPS - 1 : MOST_CHIPS);
    const chips = shown.map(({ joint, bound }) => chip(`${joint} ${bound}`, isFar ? "held" : ""));
    if (limits.length > shown.length) chips.push(chip(`and ${limits.length - shown.length} more`));
    $("#limits").replaceChildren(...chips);
  }

  /** The reason of an answer that no limit holds back, from the program that serves the page. */
  showReason(reason) {
    this.reason = `${reason[0].toUpperCase()}${reason.slice(1)}.`;
    this.showStatus();
  }

  explanation() {
    const { answer, wished, hasJumped } = this.session;
    const has = answer.limits.length > 0;
    if (answer.isOnItsWay) return "Every limit kept, all loops closed. As fast as it may, by";
    const kept = this.machine.hasLimits ? "Every limit kept, all loops closed." : "All loops closed; this machine has no limits.";
    if (answer.status === REACHED) return has ? "Every limit kept; it lies on" : kept;
    if (answer.status === EXCEEDED) return "The loops close in this mode, but beyond";
    if (answer.status >= FAILED) return "The last feasible pose is shown.";
    if (!has && this.reason) return this.reason;
    if (wished) return "These values do not fit together; this is the nearest that does.";
    const how = hasJumped ? "Nearest feasible pose, to which drives would jump," : "Nearest feasible pose,";
    return `${how} ${this.distance(answer)} short. ${has ? "Stopped by" : "Its links are stretched."}`;
  }

  distance({ errors: [position, rotation] }) {
    const { slides, turns } = this.machine.task;
    const parts = [];
    if (slides.length && (position > 0 || !turns.length)) parts.push(`${this.wording.length(position)} ${this.wording.unit}`);
    if (turns.length && (rotation > 1e-6 || !parts.length)) parts.push(`${rounded(rotation / DEGREE, 1)}°`);
    return parts.join(" and ");
  }

  showFields() {
    const { target } = this.session;
    const values = [...originOf(target).map((value) => value * this.wording.factor), ...anglesOf(target)];
    for (const { k, input } of this.fields) {
      if (document.activeElement === input) continue;
      const digits = k < 3 ? this.wording.digits : 1;
      input.value = (Math.abs(values[k]) < 0.5 * 10 ** -digits ? 0 : values[k]).toFixed(digits);
    }
  }

  showActuators() {
    const { answer, wished, joints } = this.session;
    const { actuators, series } = this.machine;
    this.showRows(this.rows, actuators, answer.actuators, wished);
    if (series) this.showRows(this.jointRows, series.coordinates, answer.actuators && this.joints, joints);
  }

  showRows(rows, coordinates, values, wished) {
    const limits = new Set(this.session.answer.limits.map(({ joint }) => joint));
    rows.forEach(({ row, input, text, wish, min, max }, k) => {
      const { isAngle, joint } = coordinates[k];
      const value = values ? values[k] : NaN;
      const isHeld = limits.has(joint);
      const share = (at) => `${100 * clamp((at - min) / (max - min), 0, 1)}%`;
      if (values && !(this.session.engine.newest?.isBusy && document.activeElement === input)) input.value = value;
      text.textContent = values ? this.wording.value(value, isAngle) : "–";
      row.classList.toggle("held", isHeld);
      row.style.setProperty("--share", share(value));
      wish.hidden = !wished || !(Math.abs(wished[k] - value) > 1e-3 * (max - min));
      if (!wish.hidden) wish.style.setProperty("--share", share(wished[k]));
      input.setAttribute("aria-valuetext", text.textContent + (isHeld ? ", at its limit" : ""));
    });
  }

  showTravel(travel) {
    const widest = (kind) =>
      Math.max(...travel.filter((each) => each.kind === kind).map(({ distance }) => Math.min(distance, this.most(kind))), 1e-9);
    const rows = travel.filter(({ sign }) => sign < 0).map((less, k) => {
      const more = travel[2 * k + 1];
      const isTurn = less.kind === "about";
      const bar = made("span", { className: `bar ${"xyz"[less.axis]}` });
      for (const each of [less, more]) {
        const part = made("i", { className: each.sign < 0 ? "less" : "more" });
        part.style.width = `${50 * clamp(each.distance / widest(each.kind), 0, 1)}%`;
        bar.append(part);
      }
      const name = made("b", { className: "xyz"[less.axis], textContent: (isTurn ? "↻" : "") + "xyz"[less.axis] });
      return made("div", { className: "travel" }, this.end(less), name, bar, this.end(more));
    });
    $("#travel div").replaceChildren(...rows);
  }

  most(kind) {
    return kind === "about" ? Math.PI : 4 * this.machine.length;
  }

  /** A button that shows how far it is, and goes there. */
  end({ kind, axis, sign, distance, limits, pose }) {
    const isTurn = kind === "about";
    const isZero = distance < 1e-6 * (isTurn ? 1 : this.machine.length);
    const amount = isZero ? "0" : (sign < 0 ? "−" : "+") + this.wording.value(distance, isTurn);
    const textContent = Number.isFinite(distance) ? amount : "free";
    const names = limits.map(({ joint, bound }) => `${joint} ${bound}`).join(", ");
    const cause = Number.isFinite(distance) ? `stopped by ${names || "stretched links"}` : "nothing stops it";
    const title = `${isTurn ? "about" : "along"} ${sign < 0 ? "−" : "+"}${"xyz"[axis]}: ${textContent}, ${cause}`;
    const button = made("button", { className: isZero ? "zero" : "", textContent, title, ariaLabel: title });
    button.disabled = isZero || !Number.isFinite(distance);
    button.onclick = () => this.session.ask(pose);
    return button;
  }

  /** Bars of the measures as shares of those at home, purple where they are small. */
  showSingular(measures, atHome) {
    this.atHome = atHome;
    const rows = ["serial", "parallel"].map((kind) => {
      const share = measures ? measures[kind] / this.atHome[kind] : NaN;
      const percent = clamp(Math.round(100 * share), 0, 100);
      const fill = made("i");
      fill.style.width = `${percent || 0}%`;
      fill.style.background = `color-mix(in srgb, var(--blue) ${percent || 0}%, var(--singular))`;
      const leg = kind === "serial" && measures?.leg && share < 0.5 ? `: ${measures.leg}` : "";
      const title = `${MEANINGS[kind]}: ${measures?.[kind]?.toPrecision(3)}, at home ${this.atHome[kind]?.toPrecision(3)}`;
      const [name, value] = [made("span", { textContent: kind + leg }), made("output", { textContent: Number.isFinite(share) ? `${(100 * share).toFixed(0)} %` : "–" })];
      return made("div", { className: "row", title }, name, made("span", { className: "bar" }, fill), value);
    });
    this.hide("near", !(this.atHome.serial > 1e-6 && measures));
    $("#near div").replaceChildren(...rows);
    this.session.observe(measures);
    $("#crossing").textContent = this.crossing(measures);
  }

  /** The nearest limits, as the program that serves the page found them: bars that are full in the middle of a range. */
  showLimits(limits, others) {
    const rows = limits.map(({ name, margin, left, unit, isOn }) => {
      const fill = made("i");
      fill.style.width = `${100 * clamp(margin, 0, 1)}%`;
      const isAngle = unit === "deg";
      const amount = isOn ? 0 : left;
      const words = isAngle ? `${rounded(amount, 1)}°` : `${this.wording.length(amount)} ${this.wording.unit}`;
      const row = made("div", { className: isOn ? "row held" : "row", title: `${name}: ${words} left` });
      row.append(made("span", { textContent: name }), made("span", { className: "bar" }, fill), made("output", { textContent: words }));
      return row;
    });
    this.hide("close", !limits.length);
    $("#close span").textContent = others ? `and ${others} farther off` : "";
    $("#close div").replaceChildren(...rows);
  }

  hide(name, isHidden) {
    $(`#${name}`).hidden = $(`#${name}-tab`).hidden = isHidden;
  }

  /** A sentence about the singularity that an answer is on, or that it has passed. */
  crossing(measures) {
    if (!measures) return "";
    const isOn = (kind) => measures[kind] < NEARLY * this.atHome[kind];
    if (isOn("parallel")) return "On a parallel singularity: locked actuators do not hold it.";
    if (isOn("serial")) return "On a serial singularity: a leg is at its dead point.";
    return this.session.isAcross ? "It passed a parallel singularity: these actuator values have another pose on the side it came from." : "";
  }

  /** A button for each mode, numbered as in the library's list. */
  showModes(modes, present) {
    this.hide("modes", modes.length < 2 && !this.machine.live);
    const buttons = modes.map((mode, k) => {
      const isBeyond = mode.status === EXCEEDED;
      const title = isBeyond ? `Mode ${k + 1}, beyond limits` : `Mode ${k + 1}`;
      const button = made("button", { className: isBeyond ? "chip beyond" : "chip", textContent: k + 1, title, ariaLabel: title });
      button.setAttribute("aria-pressed", isSame(mode.marks, present));
      button.onclick = () => this.session.take(mode);
      return button;
    });
    $("#modes div").replaceChildren(...buttons);
  }
}
