// What a page answers, without a browser: `node page_in_node.js SCRIPT...`, the question on standard input.
const fs = require("fs");

const scripts = process.argv.slice(2).map((path) => fs.readFileSync(path, "utf-8"));
const { kernels, machine, targets, path, values, link, edges, listed, spoiled, stream, speeds } = JSON.parse(fs.readFileSync(0, "utf-8"));

const names = "{ Engine, Scene, Session, singularityOf }";
const { Engine, Scene, Session, singularityOf } = new Function(`${scripts.join("\n")}; return ${names};`)();
const named = (limits) => limits.map(({ joint, bound }) => `${joint} ${bound}`);
const plain = ({ status, pose, actuators, limits }) => ({ status, pose, actuators, limits: named(limits) });

async function main() {
  const engine = await Engine.open(kernels, machine);
  const home = engine.ask(machine.home);
  let last = home;
  const followed = path.map((target) => {
    const answer = engine.ask(target, last);
    last = answer.actuators ? answer : last;
    return answer;
  });
  const plainly = ({ distance, ...rest }) => ({ ...rest, distance: Number.isFinite(distance) ? distance : null });
  const near = engine.ask(listed, home);
  const travelFrom = (answer) => engine.travel(engine.steady(answer)).map(plainly);
  const scene = new Scene(machine);
  const modesOf = (answer) => engine.modes(answer, (each) => scene.marksOf(each));
  const session = new Session(machine, engine);
  session.goHome();
  const jumped = path.map((target) => {
    session.ask(target);
    return session.hasJumped;
  });
  session.goHome();
  session.remember();
  session.open(link);
  session.remember();
  const steps = [[...session.answer.pose], session.link];
  const kept = new Session(machine, engine);
  kept.open(steps[1]);
  session.undo();
  const undone = [...session.answer.pose];
  session.redo();
  const numbers = spoiled.map((matrix) => matrix.map((number) => number ?? NaN)); // which JSON does not have
  if (stream.length) engine.rest(home);
  const answers = {
    ticks: stream.map((target) => engine.tick(target, 0.01, speeds)),
    spoiled: [null, home].map((from) => numbers.map((matrix) => engine.ask(matrix, from).status)),
    inverse: targets.map((target) => plain(engine.ask(target))),
    followed: followed.map(plain),
    jumped,
    forward: values.map((each) => plain(engine.assemble(each))),
    travel: travelFrom(home),
    edges: edges.map((edge) => {
      const answer = engine.ask(edge, home);
      return { ...plain(answer), travel: travelFrom(answer), singular: singularityOf(engine, engine.steady(answer)) };
    }),
    singular: [home, ...followed.filter(({ status }) => status === 0)].map((from) => singularityOf(engine, from)),
    modes: [near, ...modesOf(near)].map((each) => modesOf(each).map(plain)),
    steps: { asked: steps[0], kept: kept.answer.pose, undone, redone: session.answer.pose },
  };
  fs.writeFileSync(1, JSON.stringify(answers));
}
main();
