/** Events of the record as marks in a chart: which are worth a flag, which only a tick. Pure. */

import type { ChartMarker } from '../chart';
import type { RecordEventMessage } from '../api/types';

type Kind = RecordEventMessage['kind'];

const FLAGS: Partial<Record<Kind, { label: string; tone: ChartMarker['tone'] }>> = {
  start: { label: 'start', tone: 'plain' },
  ramp_start: { label: 'ramp', tone: 'plain' },
  ramp_end: { label: 'ramp ends', tone: 'plain' },
  reversal: { label: 'reversal', tone: 'plain' },
  gains: { label: 'gains', tone: 'plain' },
  limit: { label: '▲ limit', tone: 'warn' },
  pause: { label: '▲ pause', tone: 'warn' },
  resume: { label: 'resume', tone: 'plain' },
  restart: { label: '■ restart', tone: 'bad' },
  link_lost: { label: '■ link lost', tone: 'bad' },
  stop: { label: '■ stop', tone: 'bad' },
  fault: { label: '■ fault', tone: 'bad' },
  end: { label: 'end', tone: 'plain' },
};

/** Marks of these events within [from, to]; what comes often (retries, missing samples) is a tick without a name. */
export function marksOf(events: readonly RecordEventMessage[], from: number, to: number): ChartMarker[] {
  const marks: ChartMarker[] = [];
  for (const event of events) {
    if (event.host_time < from || event.host_time > to || event.kind === 'note') continue;
    const flag = FLAGS[event.kind];
    if (flag === undefined) marks.push({ x: event.host_time, label: '', tone: 'tick' });
    else marks.push({ x: event.host_time, label: flag.label, tone: flag.tone ?? 'plain' });
  }
  return marks;
}
