/** How the gap between measurement and simulation shrinks, step by step, against the noise floor. */

import type { DiagnosisData } from '../api/types';
import { fixed } from '../format';
import { parameterName } from '../models/parameters';

export interface Stage {
  name: string;
  /** Under a picture: effects are counted. */
  label: string;
  /** Root mean square by joint, in the joint's unit, in the order of the joints; null where it is not finite. */
  fit: readonly (number | null)[];
  held: readonly (number | null)[] | null;
}

export interface Gap {
  joints: readonly number[];
  units: readonly string[];
  floor: readonly number[];
  stages: readonly Stage[];
  /** What the numbers would have had to become without the effects; empty where none was added. */
  without: string;
}

/** What the numbers alone would make of it, in words, with the parameters called as on the page. */
export function withoutText({ gap, words }: Pick<DiagnosisData, 'gap' | 'words'>): string {
  const without = gap?.without;
  return (without?.numbers ?? []).reduce(
    (text, { name }) => text.replaceAll(name, parameterName(name, words)),
    without?.text ?? '',
  );
}

/** The stages of a diagnosis: the model as given, with every effect that was added, with everything refitted. */
export function gapOf(found: DiagnosisData): Gap {
  const gap = found.gap;
  if (!gap) return { joints: [], units: [], floor: [], stages: [], without: '' };
  return {
    joints: gap.joints,
    units: gap.units,
    floor: gap.noise,
    without: withoutText(found),
    stages: gap.stages.map((stage, place) => ({
      name: stage.name,
      label: labelOf(
        gap.stages.map((one) => one.kind),
        place,
      ),
      fit: stage.fitted,
      held: stage.held_out.length === 0 ? null : stage.held_out,
    })),
  };
}

function labelOf(kinds: readonly string[], place: number): string {
  const kind = kinds[place]!;
  if (kind === 'effect') return `+${kinds.slice(0, place + 1).filter((one) => one === 'effect').length}`;
  return kind === 'refitted' ? 'all' : kind;
}

/** A share of the variance beyond noise that is gone, in percent: “all” for all of it, never rounded up to 100 %. */
export function goneText(share: number): string {
  return share >= 1 ? 'all' : `${fixed(Math.min(100 * share, 99.9), 1)} %`;
}

/** Round values from 0 to beyond the largest of these: the ticks of an axis, the last one its end. */
export function ticksFromZero(values: readonly number[]): number[] {
  const most = Math.max(0, ...values);
  if (most === 0) return [0, 1];
  const step = roundUp(most / 4);
  const count = Math.ceil((most * 1.05) / step);
  return Array.from({ length: count + 1 }, (_, index) => Number((index * step).toPrecision(3)));
}

const ROUND = [1, 2, 5, 10];

function roundUp(value: number): number {
  const power = 10 ** Math.floor(Math.log10(value));
  return power * (ROUND.find((digit) => digit * power >= value * 0.9999) ?? 10);
}
