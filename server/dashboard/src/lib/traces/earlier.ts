/** How a run's figures stand beside the machine file's limits, and beside earlier runs of the same experiment. Pure. */

import type { CatalogueEntry, Machine, TraceDetails } from '../api';
import { fixed } from '../format';

type Figures = TraceDetails['figures'];
type Figure = Figures[number];

/** Runs that are compared at most: the newest before it. */
export const COMPARED = 5;
/** Fewer have no range of their own to be told from. */
const FEWEST = 3;
const DEGREES = 180 / Math.PI;

/** What the largest error and the largest drive of a joint may come to; null where the machine file does not say. */
export function limitsOf(
  machine: Machine | null | undefined,
  joint: number,
  driveUnit: string | null,
): { error: number | null; drive: number | null } {
  const one = machine?.joints[joint - 1];
  const counts = machine?.limits?.following_error_counts ?? null;
  const sensor = one?.kind === 'revolute' ? one.sensor : null;
  const count = sensor?.bits ? (sensor.range.value / 2 ** sensor.bits) * DEGREES : null;
  const error = counts === null || count === null ? null : counts * count;
  const drive =
    one?.drive?.kind === 'dc_motor' && driveUnit === 'V' ? (one.drive.supply_limit?.value ?? null) : null;
  return { error, drive };
}

/** Whether a trace is of a whole experiment of this service: an uploaded trace may be of any arm. */
export function isWholeRun({ experiment, outcome }: CatalogueEntry): boolean {
  return experiment !== null && outcome === 'complete';
}

/** Whether two whole runs are of the same experiment on the same arm. */
export function isSameExperiment(one: TraceDetails, other: TraceDetails): boolean {
  const { spec, source, robot } = one.record;
  return (
    [one.entry, other.entry].every(isWholeRun) &&
    other.record.source === source &&
    other.record.robot === robot &&
    JSON.stringify(spec) === JSON.stringify(other.record.spec)
  );
}

/** One line on how the figures compare with those of earlier runs (the newest first); empty without any. */
export function besideEarlier(
  figures: Figures,
  earlier: readonly Figures[],
  driveUnit: string | null,
): string {
  if (earlier.length === 0) return '';
  const runs = earlier.length === 1 ? 'the earlier run' : `the ${earlier.length} earlier runs`;
  const told = figures.flatMap((one) =>
    (
      [
        ['error', 'largest_error', one.unit],
        ['drive', 'largest_drive', driveUnit === null ? '' : ` ${driveUnit}`],
      ] as const
    ).flatMap(([what, key, unit]) => {
      const before = earlier.flatMap((each) => valueOf(each, one.joint, key));
      const now = one[key];
      if (now === null || before.length === 0 || isWithin(now, before)) return [];
      const [low, high] = [Math.min(...before), Math.max(...before)].map(
        (value) => `${fixed(value, 2)}${unit}`,
      );
      const range = low === high ? low : `${low} to ${high}`;
      return [`J${one.joint} largest ${what} ${fixed(now, 2)}${unit}, was ${range}`];
    }),
  );
  if (told.length === 0) return `As in ${runs} of this experiment: error and drive are within their range.`;
  const verdict =
    earlier.length < FEWEST ? `Differs from ${runs} (too few to judge by)` : `Outside the range of ${runs}`;
  return `${verdict}: ${told.join('; ')}.`;
}

function valueOf(figures: Figures, joint: number, key: 'largest_error' | 'largest_drive'): number[] {
  const value = figures.find((one: Figure) => one.joint === joint)?.[key];
  return value == null ? [] : [value];
}

/** Within what the earlier ones span, and as much again on either side: a few runs do not show the whole range. */
function isWithin(now: number, before: readonly number[]): boolean {
  const [low, high] = [Math.min(...before), Math.max(...before)];
  const more = before.length < FEWEST ? 0 : high - low;
  return now >= low - more && now <= high + more;
}
