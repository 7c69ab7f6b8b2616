/** What happened at the arm and who asked for it, in one wording: events name the caller, the service's prose may not. Pure. */

import type { QueueStatus, RobotMessage, ServiceEvent } from '../api/types';
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

/** Rows that follow one another and say the same, as one: a press of Stop is sent until it is answered. */
export function together<T>(rows: readonly T[], said: (row: T) => string): { row: T; times: number }[] {
  const found: { row: T; times: number }[] = [];
  for (const row of rows) {
    const last = found.at(-1);
    if (last !== undefined && said(last.row) === said(row)) last.times += 1;
    else found.push({ row, times: 1 });
  }
  return found;
}

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
  const by = events.find(({ kind, actor, at }) => {
    const after = Date.parse(at) - since;
    return actor != null && ((kind === 'queue' && after >= 0) || (kind === 'stop' && after > -CAUSED_WITHIN));
  });
  if (by === undefined) return queue;
  if (by.kind === 'stop')
    return queue.paused
      ? { ...queue, reason: `${pressed(by, who)}: look at the arm, then resume the queue` }
      : queue;
  return {
    ...queue,
    reason: `${who(by.actor!)} ${queue.paused ? 'paused' : 'resumed'} it at ${timeOfDay(by.at)}`,
  };
}
