/** Handing experiments to the service: the same requests for the form, the console and the macros. They throw Problems. */

import { api, ask, here, type ConsoleOrder, type Experiment, type ExperimentSpec } from '../api';
import type { MotionPreview, Schedule } from '../api';
import { dayAndTime, duration } from '../format';
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
  when: { cron?: string; every?: number; starts?: string | null; count?: number | null; priority?: number },
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

/** A motion in one line, and the limits that it breaks. */
export function toldMotion(
  spec: ConsoleOrder['spec'],
  motion: MotionPreview,
): { text: string; violations: string[] } {
  const kind = (spec?.trajectory.kind ?? 'motion').replaceAll('_', ' ');
  const moving =
    motion.moving.length > 0
      ? `joint${motion.moving.length > 1 ? 's' : ''} ${motion.moving.join(', ')}`
      : 'nothing';
  const text = `${kind}: ${duration(motion.duration)}, moves ${moving}`;
  return { text, violations: motion.violations.map((one) => one.message) };
}
