/** What happened at the arm and who asked for it, in one wording: events name the caller, the service's prose may not. Pure. */

import type { Experiment, QueueStatus, RobotMessage, ServiceEvent } from '../api/types';
import { timeOfDay } from '../format';

/** A name as the person at this page reads it; of whoever pressed Stop, `stoppedAt` some time. */
type Who = (name: string, stoppedAt?: string) => string;
/** ms by which a stop may come before the pause of the queue that it causes. */
const CAUSED_WITHIN = 5000;

/** The newest first: what was told since, before what was asked for; each once. */
export function newestEvents(
  told: readonly ServiceEvent[],
  asked: readonly ServiceEvent[],
  most: number,
): readonly ServiceEvent[] {
  const known = new Set(asked.map((event) => event.number));
  return [...told.filter((event) => !known.has(event.number)), ...asked].slice(0, most);
}

/** Rows that say the same: the newest, and when the oldest was. */
export interface Group<T> {
  row: T;
  since: string;
  all: T[];
}

/** Rows by their times, the newest first: one that counts repeats is told late. Those that follow one another and say the
 * same are one group: a press of Stop is sent until it is answered. */
export function together<T extends { at: string }>(rows: readonly T[], said: (row: T) => string): Group<T>[] {
  const found: Group<T>[] = [];
  for (const row of rows.toSorted((one, other) => Date.parse(other.at) - Date.parse(one.at))) {
    const last = found.at(-1);
    if (last !== undefined && said(last.row) === said(row)) {
      last.all.push(row);
      last.since = row.at;
    } else found.push({ row, since: row.at, all: [row] });
  }
  return found;
}

/** How often, as the end of a sentence: `, 17 times since 11:51:22`; empty for once. */
export function timesText(
  { row, since }: Pick<Group<{ at: string }>, 'row' | 'since'>,
  count: number,
): string {
  if (count <= 1) return '';
  const [first, last] = [timeOfDay(since), timeOfDay(row.at)];
  return `, ${count} times${first === last ? '' : ` since ${first}`}`;
}

/** What an event says by itself, without its kind, which a phone has no room for: `the queue was paused`. */
export function eventText({ kind, text }: Pick<ServiceEvent, 'kind' | 'text'>): string {
  return kind in SUBJECTS ? `${SUBJECTS[kind]} was ${text}` : text;
}

const SUBJECTS: Readonly<Record<string, string>> = { queue: 'the queue', connection: 'the arm' };

/** The service's name in its prose for those who need none. */
const AT_SERVICE = "somebody at the service's computer";

/** The reason of an end, with the name of whoever cancelled it as the person at this page reads it. */
export function withYou(reason: string, who: Who): string {
  return reason.replace(
    /^cancelled by ([^.;:]+)/,
    (_, name: string) => `cancelled by ${who(name === AT_SERVICE ? 'local' : name)}`,
  );
}

const pressed = (event: ServiceEvent, who: Who): string =>
  `${who(event.actor!, event.at)} pressed STOP at ${timeOfDay(event.at)}`;

/** Why an experiment ended, with who pressed Stop while it ran, as the person at this page reads it. */
export function endReason(
  { reason, started, ended }: Pick<Experiment, 'reason' | 'started' | 'ended'>,
  events: readonly ServiceEvent[],
  who: Who,
): string {
  const named = withYou(reason, who);
  if (named !== reason || !started || !ended) return named;
  const isMeanwhile = (at: string): boolean =>
    Date.parse(started) <= Date.parse(at) && Date.parse(at) <= Date.parse(ended);
  const by = events.find(({ kind, actor, at }) => kind === 'stop' && actor != null && isMeanwhile(at));
  return by === undefined ? reason : pressed(by, who);
}

/** Beginning of the cause of a stop by the service itself, which does not know there for which of two reasons. */
const BY_SERVICE = 'by the service: the experiment was cancelled';

/** The robot, with who stopped it where somebody did by the service. */
export function withStopper(
  robot: RobotMessage | null,
  events: readonly ServiceEvent[],
  who: Who,
): RobotMessage | null {
  if (robot?.arm !== 'stopped') return robot;
  const last = events.find(({ kind }) => kind === 'stop' || kind === 'reset' || kind === 'experiment');
  if (last?.kind === 'experiment') {
    const by = /: (cancelled by .*)$/.exec(last.text)?.[1];
    if (by !== undefined && robot.cause.startsWith(BY_SERVICE)) return { ...robot, cause: withYou(by, who) };
    return withStopper(
      robot,
      events.filter(({ kind }) => kind !== 'experiment'),
      who,
    );
  }
  return last?.kind === 'stop' && last.actor != null ? { ...robot, cause: pressed(last, who) } : robot;
}

/** The queue, with who paused or resumed it where somebody did. */
export function withPauser(
  queue: QueueStatus | null,
  events: readonly ServiceEvent[],
  who: Who,
): QueueStatus | null {
  if (queue === null) return null;
  const since = Date.parse(queue.since);
  const by = events.find(
    ({ kind, actor, at }) =>
      actor != null && (kind === 'queue' || (kind === 'stop' && Date.parse(at) - since > -CAUSED_WITHIN)),
  );
  // Whoever resumed it before has ended the pause of an earlier stop: this one is the service's.
  if (by === undefined || (by.kind === 'queue' && Date.parse(by.at) < since)) return queue;
  if (by.kind === 'stop')
    return queue.paused
      ? { ...queue, reason: `${pressed(by, who)}: look at the arm, then resume the queue` }
      : queue;
  return {
    ...queue,
    reason: `${who(by.actor!)} ${queue.paused ? 'paused' : 'resumed'} it at ${timeOfDay(by.at)}`,
  };
}
