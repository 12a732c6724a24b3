// What a page answers, without a browser: `node page_in_node.js SCRIPT...`, the question on standard input.
const fs = require("fs");

const scripts = process.argv.slice(2).map((path) => fs.readFileSync(path, "utf-8"));
const { kernels, machine, targets, path, values, link } = JSON.parse(fs.readFileSync(0, "utf-8"));

const { Engine, Session, singularityOf } = new Function(`${scripts.join("\n")}; return { Engine, Session, singularityOf };`)();
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
  const travel = engine.travel(home).map(({ distance, ...rest }) => ({ ...rest, distance: Number.isFinite(distance) ? distance : null }));
  const session = new Session(machine, engine);
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
  const answers = {
    inverse: targets.map((target) => plain(engine.ask(target))),
    followed: followed.map(plain),
    forward: values.map((each) => plain(engine.assemble(each))),
    travel,
    singular: [home, ...followed.filter(({ status }) => status === 0)].map((from) => singularityOf(engine, from)),
    modes: engine.modes(home).map(plain),
    steps: { asked: steps[0], kept: kept.answer.pose, undone, redone: session.answer.pose },
  };
  fs.writeFileSync(1, JSON.stringify(answers));
}
main();
