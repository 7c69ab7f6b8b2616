/** Handing experiments to the service: the same requests for the form, the console and the macros. They throw Problems. */

import { api, ask, here, type ConsoleOrder, type Experiment, type ExperimentSpec } from '../api';
import type { Machine, MotionPreview, Schedule } from '../api';
import { dayAndTime, duration } from '../format';
import { movesInWords } from '../trajectory/preview';
import { fromNow } from '../trajectory/when';

/** What a specification would move. Nothing is queued. */
export async function previewOf(spec: ExperimentSpec): Promise<MotionPreview> {
  const body = { spec, priority: 0 };
  return ask(api.POST('/api/v1/robots/{robot}/experiments/preview', { params: { path: here() }, body }));
}

/** Adds an experiment to the queue: once for each key. */
export async function addToQueue(
  spec: ExperimentSpec,
  key: string,
  more: { priority?: number; at?: string } = {},
): Promise<Experiment> {
  const params = { path: here(), header: { 'idempotency-key': key } };
  return ask(
    api.POST('/api/v1/robots/{robot}/experiments', { params, body: { spec, priority: 0, ...more } }),
  );
}

/** Adds a schedule. */
export async function addSchedule(
  spec: ExperimentSpec,
  when: {
    cron?: string;
    zone?: string;
    every?: number;
    starts?: string | null;
    count?: number | null;
    priority?: number;
  },
): Promise<Schedule> {
  const body = { spec, priority: 0, ...when };
  return ask(api.POST('/api/v1/robots/{robot}/schedules', { params: { path: here() }, body }));
}

/** What became of an experiment, for its line. */
export const toldQueued = (made: Experiment): string =>
  `${made.spec.name ?? made.spec.trajectory.kind} was added to the queue`;

/** What became of a schedule, for its line. `now`: ms, by the service's clock. */
export function toldScheduled(made: Schedule, now: number): string {
  const next = made.next ? `next ${fromNow(made.next, now)}` : 'no run is left';
  const runs = made.count === null ? 'without an end' : `${made.count} run${made.count === 1 ? '' : 's'}`;
  return `Planned: ${made.rule}, ${next}, ${runs}${made.last ? `, last on ${dayAndTime(made.last)}` : ''}`;
}

/** Hands over what a line of `run` asks for, and says what became of it. `now` as for `toldScheduled`. */
export async function submit(order: ConsoleOrder, key: string, now: number): Promise<string> {
  const spec = order.spec as unknown as ExperimentSpec;
  if (order.cron !== null) return toldScheduled(await addSchedule(spec, { cron: order.cron }), now);
  return toldQueued(await addToQueue(spec, key));
}

/** When what a line asks for would be repeated; empty for once. `now` as for `toldScheduled`. */
export const toldRule = ({ rule, next }: ConsoleOrder, now: number): string =>
  rule && `repeated ${rule}, first run ${next ? fromNow(next, now) : 'never'}`;

/** A motion in lines, when it would be repeated, and the limits that it breaks. */
export function toldMotion(
  order: ConsoleOrder,
  motion: MotionPreview,
  machine: Machine | null,
  now: number,
): { lines: string[]; violations: string[] } {
  const kind = (order.spec?.trajectory.kind ?? 'motion').replaceAll('_', ' ');
  const moves = machine === null ? [] : movesInWords(motion, machine.joints, machine.limits);
  const lines = [
    `${kind}: ${duration(motion.duration)}${motion.moving.length > 0 ? '' : ', moves nothing'}`,
    ...moves,
    toldRule(order, now),
  ];
  return { lines: lines.filter(Boolean), violations: motion.violations.map((one) => one.message) };
}
