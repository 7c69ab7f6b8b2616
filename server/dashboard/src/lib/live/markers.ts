/** Events of the record as marks in a chart: which are worth a flag, which only a tick. Pure. */

import type { ChartMarker } from '../chart';
import type { RecordEventMessage } from '../api/types';

type Kind = RecordEventMessage['kind'];

const FLAGS: Partial<Record<Kind, { label: string; tone: ChartMarker['tone'] }>> = {
  start: { label: 'start', tone: 'plain' },
  reversal: { label: 'reversal', tone: 'plain' },
  gains: { label: 'gains', tone: 'plain' },
  limit: { label: '▲ limit', tone: 'warn' },
  pause: { label: '▲ set points wait', tone: 'warn' },
  resume: { label: 'resume', tone: 'plain' },
  restart: { label: '■ restart', tone: 'bad' },
  link_lost: { label: '■ link lost', tone: 'bad' },
  stop: { label: '■ stop', tone: 'bad' },
  fault: { label: '■ fault', tone: 'bad' },
  end: { label: 'end', tone: 'plain' },
};

type RecordEvent = Pick<RecordEventMessage, 'kind' | 'message'>;

/** What a mark is called. The ends of a motion say themselves which motion it is: `ramp starts`, `sine ends`. */
export function markLabel(event: RecordEvent): string {
  if (event.kind === 'ramp_start' || event.kind === 'ramp_end') return event.message || 'motion';
  return FLAGS[event.kind]?.label ?? '';
}

/** The mark of an event at `x`; what comes often (retries, missing samples) is a tick without a name. */
export function markOf(event: RecordEvent, x: number): ChartMarker {
  const label = markLabel(event);
  if (label === '') return { x, label, tone: 'tick' };
  return { x, label, tone: FLAGS[event.kind]?.tone ?? 'plain' };
}

/** Kinds of which no mark stands in a chart: they are read, or there are dozens of them. */
const UNMARKED: readonly Kind[] = ['note', 'waypoint'];

/** Whether a mark stands in a chart for it. */
export const isMarked = ({ kind }: Pick<RecordEventMessage, 'kind'>): boolean => !UNMARKED.includes(kind);

/** Marks of these events within [from, to]. */
export function marksOf(events: readonly RecordEventMessage[], from: number, to: number): ChartMarker[] {
  return events
    .filter((event) => event.host_time >= from && event.host_time <= to && isMarked(event))
    .map((event) => markOf(event, event.host_time));
}

export interface Explanation {
  label: string;
  count: number;
  /** What the events said: the newest of them. */
  text: string;
}

const UNUSUAL: readonly Kind[] = [
  'limit',
  'pause',
  'restart',
  'link_lost',
  'stop',
  'fault',
  'missing',
  'retry',
];
const TICKS: Partial<Record<Kind, string>> = { missing: '◆ missing samples', retry: '◆ repeated requests' };

/** The events of something that should not have happened, or held the arm up; repeated requests are left to the link. */
export function unusualOf(events: readonly RecordEventMessage[]): RecordEventMessage[] {
  return events.filter((event) => UNUSUAL.includes(event.kind) && !(event.kind in TICKS));
}

/** What the marks of unusual events within [from, to] mean, by name in the order in which they first came. */
export function explanationsOf(
  events: readonly RecordEventMessage[],
  from: number,
  to: number,
): Explanation[] {
  const found = new Map<Kind, Explanation>();
  for (const event of events) {
    if (event.host_time < from || event.host_time > to || !UNUSUAL.includes(event.kind)) continue;
    const label = TICKS[event.kind] ?? markLabel(event);
    const count = (found.get(event.kind)?.count ?? 0) + 1;
    found.set(event.kind, { label, count, text: event.message });
  }
  return [...found.values()];
}
