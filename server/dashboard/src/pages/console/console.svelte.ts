/** The console: lines of the command line's language, and what became of them. The service reads a line; what it asks for
 * is carried out as the page's own buttons do. */

import { api, ask, asProblem, here, newKey, type ConsoleCommand, type ConsoleOrder } from '../../lib/api';
import type { ExperimentSpec } from '../../lib/api';
import { helpOf } from '../../lib/console/completion';
import { macroAsked, macroCommands, type AskedMacro } from '../../lib/console/macro_lines';
import { dayAndTime, fixed, sentence } from '../../lib/format';
import { live } from '../../lib/live/live.svelte';
import { previewOf, submit, toldMotion } from '../../lib/queue/submit';
import { queueState } from '../../lib/queue/words';
import { linkTo } from '../../lib/router.svelte';
import { stop } from '../../lib/stop/stop.svelte';

export interface Told {
  readonly text: string;
  readonly tone?: 'good' | 'bad' | 'warn';
  readonly href?: string;
}

/** A question that comes before an order is carried out. */
export interface Question {
  readonly text: string;
  readonly action: string;
  readonly answer: () => Promise<Told[]>;
}

interface Answer {
  readonly told: Told[];
  readonly question?: Question;
}

export interface Entry {
  readonly id: number;
  readonly line: string;
  told: readonly Told[];
  question: Question | null;
}

const KEPT = 200;
const SHOWN = 12;
const say = (text: string, tone?: Told['tone']): Told => (tone === undefined ? { text } : { text, tone });
const REAL_ARM = 'This is a real arm: its workspace is clear, and it may move.';

class Console {
  commands = $state.raw<readonly ConsoleCommand[]>([]);
  entries = $state.raw<readonly Entry[]>([]);
  busy = $state(false);
  private count = 0;

  /** Asks for the commands. Throws a Problem. */
  async load(): Promise<void> {
    const params = { path: here() };
    const [commands, { kept }] = await Promise.all([
      ask(api.GET('/api/v1/robots/{robot}/console/commands', { params })),
      ask(api.GET('/api/v1/robots/{robot}/macros', { params })),
    ]);
    this.commands = [...commands, ...macroCommands(kept.map((one) => one.macro))];
  }

  get lines(): string[] {
    return this.entries.map((one) => one.line);
  }

  /** Carries out a line; `isDry`: only says what it would do. */
  async enter(line: string, isDry: boolean): Promise<void> {
    const words = line.trim().split(/\s+/);
    if (words[0] === 'daq') words.shift();
    if (words[0] === 'clear') {
      this.entries = [];
      return;
    }
    if (words[0] === 'help') {
      this.tell(line, { told: helpOf(words.slice(1), this.commands).map((text) => say(text)) });
      return;
    }
    await this.during(line, async () => {
      if (words[0] === 'macro') {
        // One may have been kept since.
        await this.load();
        return carryOutMacro(macroAsked(words, this.commands), isDry);
      }
      const body = { line };
      const order = await ask(
        api.POST('/api/v1/robots/{robot}/console/read', { params: { path: here() }, body }),
      );
      return carryOut(order, isDry || order.dry_run);
    });
  }

  /** The answer to a question: what was asked is carried out. */
  async agree(entry: Entry): Promise<void> {
    const question = entry.question;
    if (question === null || this.busy) return;
    this.busy = true;
    let told: Told[];
    try {
      told = await question.answer();
    } catch (error) {
      told = refusal(error);
    }
    this.entries = this.entries.map((one) =>
      one.id === entry.id ? { ...one, told: [...one.told, ...told], question: null } : one,
    );
    this.busy = false;
  }

  private async during(line: string, work: () => Promise<Answer>): Promise<void> {
    this.busy = true;
    try {
      this.tell(line, await work());
    } catch (error) {
      this.tell(line, { told: refusal(error) });
    } finally {
      this.busy = false;
    }
  }

  private tell(line: string, answer: Answer): void {
    const entry = { id: this.count++, line, told: answer.told, question: answer.question ?? null };
    this.entries = [...this.entries, entry].slice(-KEPT);
  }
}

/** It keeps its answers and earlier lines while other pages are looked at. */
export const desk = new Console();

function refusal(error: unknown): Told[] {
  const problem = asProblem(error);
  return [say(problem.detail, 'bad'), ...(problem.advice ? [say(sentence(problem.advice))] : [])];
}

async function carryOut(order: ConsoleOrder, isDry: boolean): Promise<Answer> {
  if (order.words[0] === 'run') return run([order], isDry);
  const known = ORDERS[order.words.join(' ')];
  if (known === undefined) return { told: [say('not on this page; type it in a terminal', 'bad')] };
  if (isDry && !known.isLook) return { told: [say(`would ${known.does}; nothing was done`)] };
  return known.carryOut(order);
}

async function carryOutMacro({ name, values, isDry }: AskedMacro, isDryRun: boolean): Promise<Answer> {
  const params = { path: { ...here(), macro: name } };
  const body = { values };
  const { orders } = await ask(api.POST('/api/v1/robots/{robot}/macros/{macro}/read', { params, body }));
  return run(orders, isDry || isDryRun);
}

/** Shows the motion of each order; all are sent, or none. */
async function run(orders: readonly ConsoleOrder[], isDry: boolean): Promise<Answer> {
  const told: Told[] = [];
  let isRefused = false;
  for (const order of orders) {
    const motion = await previewOf(order.spec as unknown as ExperimentSpec);
    const { lines, violations } = toldMotion(order, motion, live.machine, live.wall);
    told.push(...lines.map((one) => say(one)), ...violations.map((one) => say(one, 'bad')));
    isRefused ||= violations.length > 0;
  }
  if (isRefused) return { told: [...told, say('refused; nothing was sent', 'bad')] };
  if (isDry) return { told: [...told, say('no limit is violated; nothing was sent', 'good')] };
  const keyed = orders.map((order) => [order, newKey()] as const);
  const answer = async (): Promise<Told[]> => {
    const sent: Told[] = [];
    for (const [order, key] of keyed)
      sent.push({ text: await submit(order, key, live.wall), tone: 'good', href: linkTo('experiments') });
    return [...sent, ...waiting()];
  };
  if (!live.isRealArm) return { told: [...told, ...(await answer())] };
  const action = orders.every((one) => one.cron === null) ? 'Add to the queue' : 'Add the schedule';
  return { told, question: { text: 'This is a real arm.', action, answer } };
}

/** Why what was added does not begin at once. */
function waiting(): Told[] {
  const queue = live.queue;
  if (queue === null || !(queue.paused || queue.waiting_for)) return [];
  const { head, text } = queueState(queue, live.robot?.connection === 'connected');
  return [say(`${head} ${text}`, 'warn')];
}

interface Known {
  /** Whether it only looks. */
  readonly isLook?: boolean;
  readonly does: string;
  readonly carryOut: (order: ConsoleOrder) => Promise<Answer> | Answer;
}

const path = (): { path: { robot: string } } => ({ path: here() });

async function resume(movesRealArm: boolean): Promise<Told[]> {
  const body = { moves_real_arm: movesRealArm };
  await ask(api.POST('/api/v1/robots/{robot}/queue/resume', { params: path(), body }));
  return [say('the queue is open: what waits begins', 'good')];
}

const ORDERS: Readonly<Record<string, Known>> = {
  stop: {
    does: 'freeze the arm',
    carryOut: () => {
      stop.press();
      return { told: [say('stop sent; its result is at the top of the page', 'warn')] };
    },
  },
  reset: {
    does: 'end the stop; nothing moves',
    carryOut: async () => {
      const shown = live.robot?.stop ?? null;
      if (shown === null) return { told: [say('nothing is stopped')] };
      const body = { stop: shown, here: false };
      await ask(api.POST('/api/v1/robots/{robot}/reset', { params: path(), body }));
      return { told: [say('the stop has ended; the queue stays paused', 'good')] };
    },
  },
  status: {
    isLook: true,
    does: 'show the state',
    carryOut: () => {
      const { robot, sample, machine } = live;
      const head = `${robot?.arm ?? 'not known'}${robot?.cause ? `: ${robot.cause}` : ''}`;
      if (sample === null || live.isStale || machine === null)
        return { told: [say(head), say('no live sample', 'warn')] };
      const rows = sample.joints.map((joint, place) => {
        const slides = machine.joints[joint - 1]?.kind === 'prismatic';
        const shown = (value: number | undefined): string =>
          slides ? `${fixed((value ?? NaN) * 1000, 1)} mm` : `${fixed(((value ?? NaN) * 180) / Math.PI, 2)}°`;
        const { position, set_point, error } = sample;
        return `joint ${joint}  ${shown(position[place]).padStart(9)}   set point ${shown(set_point[place]).padStart(9)}   error ${shown(error[place]).padStart(8)}`;
      });
      return { told: [say(head), ...rows.map((text) => say(text))] };
    },
  },
  'gains show': {
    isLook: true,
    does: 'show the gains',
    carryOut: async () => {
      const { gains } = await ask(api.GET('/api/v1/robots/{robot}/gains', { params: path() }));
      const rows = Object.entries(gains).map(
        ([joint, [p, i, d]]) => `joint ${joint}: P ${p}  I ${i}  D ${d}`,
      );
      return { told: rows.length > 0 ? rows.map((text) => say(text)) : [say('the memory map has no gains')] };
    },
  },
  'queue show': {
    isLook: true,
    does: 'show the queue',
    carryOut: async () => {
      const waits = await ask(api.GET('/api/v1/robots/{robot}/queue/experiments', { params: path() }));
      const state = live.queue && queueState(live.queue, live.robot?.connection === 'connected');
      const rows = waits.map(
        (one) => `${one.id}  ${one.spec.name ?? one.spec.trajectory.kind}, by ${one.owner}`,
      );
      return {
        told: [say(`${state?.head ?? ''} ${state?.text ?? ''}`.trim()), ...rows.map((text) => say(text))],
      };
    },
  },
  'queue pause': {
    does: 'pause the queue',
    carryOut: async () => {
      await ask(api.POST('/api/v1/robots/{robot}/queue/pause', { params: path() }));
      return { told: [say('the queue is paused; a running experiment goes on', 'good')] };
    },
  },
  'queue resume': {
    does: 'let the queue move the arm',
    carryOut: async () => {
      if (!live.isRealArm) return { told: await resume(false) };
      return {
        told: [],
        question: { text: REAL_ARM, action: 'Resume the queue', answer: () => resume(true) },
      };
    },
  },
  'queue schedules': {
    isLook: true,
    does: 'list the schedules',
    carryOut: async () => {
      const { items } = await ask(api.GET('/api/v1/robots/{robot}/schedules', { params: path() }));
      const rows = items.map(
        (one) =>
          `${one.id}  ${one.spec.name ?? one.spec.trajectory.kind}: ${one.rule}, ${one.next ? `next ${dayAndTime(one.next)}` : one.problem || 'off or complete'}`,
      );
      return { told: rows.length > 0 ? rows.map((text) => say(text)) : [say('no schedules')] };
    },
  },
  'queue unschedule': {
    does: 'delete the schedule',
    carryOut: async (order) => {
      const schedule = String(order.values['schedule']);
      const params = { path: { ...here(), schedule } };
      await ask(api.DELETE('/api/v1/robots/{robot}/schedules/{schedule}', { params }));
      return { told: [say(`schedule ${schedule} was deleted`, 'good')] };
    },
  },
  'traces ls': {
    isLook: true,
    does: 'list the traces',
    carryOut: async () => {
      const params = { ...path(), query: { limit: SHOWN } };
      const { items } = await ask(api.GET('/api/v1/robots/{robot}/traces', { params }));
      const told = items.toReversed().map((one) => ({
        text: `${one.id}  ${dayAndTime(one.created)}  ${one.name ?? one.kind}  ${one.outcome ?? ''}`,
        href: linkTo('traces', one.id),
      }));
      return { told: told.length > 0 ? told : [say('no traces yet')] };
    },
  },
};
