/** A trajectory in words: one line a piece. */

import { DEGREES } from './fields';

type Move = Readonly<Record<string, unknown>>;
interface Segment {
  readonly move: Move;
  readonly joints?: readonly number[] | null;
}

export function inWords(trajectory: Move): string[] {
  if (trajectory.kind !== 'sequence') return [moveInWords(trajectory)];
  return (trajectory.segments as Segment[]).map(({ move, joints }) => {
    const on = joints ? `, joint${joints.length > 1 ? 's' : ''} ${joints.join(', ')}` : '';
    return `${moveInWords(move)}${on}`;
  });
}

/** The same in a few words, for a list: with its numbers, since runs of one name may differ in them. */
export function motionOf(trajectory: Move): string {
  const [first, ...more] = inWords(trajectory);
  return first !== undefined && more.length === 0 ? first : String(trajectory.kind).replaceAll('_', ' ');
}

function moveInWords(move: Move): string {
  const kind = String(move.kind).replaceAll('_', ' ');
  if (move.kind === 'path') {
    const times = move.times as readonly number[];
    return `path of ${times.length} points in ${short(times.at(-1) ?? 0)} s`;
  }
  if (move.kind === 'via') {
    const times = move.times as readonly number[];
    return `via ${times.length} points in ${short(times.at(-1) ?? 0)} s`;
  }
  const amplitude = move.amplitude === undefined ? '' : ` ${amplitudeInWords(move.amplitude)}`;
  const time = typeof move.duration === 'number' ? ` ${amplitude ? 'in ' : ''}${short(move.duration)} s` : '';
  const speed = typeof move.speed === 'number' ? ` at ${short(move.speed * DEGREES)} °/s` : '';
  return `${kind}${amplitude}${time}${speed}`;
}

function amplitudeInWords(amplitude: unknown): string {
  if (typeof amplitude === 'number') return `${short(amplitude * DEGREES)}°`;
  return Object.values(amplitude as Record<string, number>)
    .map((value) => `${short(value * DEGREES)}°`)
    .join(' / ');
}

function short(value: number): string {
  return String(Number(value.toPrecision(4))).replace('-', '−');
}
