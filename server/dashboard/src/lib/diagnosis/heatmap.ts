/**
 * The map of disagreement: joint by phase against time. The diagnosis tells windows of 0.3 s; the map puts as many of
 * them together as there is room for, so that each of its cells has room for its number.
 */

import type { PhaseCell } from '../api/types';
import { PHASES, type Phase } from './words';

/** How many times its noise a joint is off, up to which a level goes; the last has no end. */
export const LEVELS = [1.25, 2, 4, 8, Infinity] as const;

export interface MapCell {
  /** s. */
  start: number;
  end: number;
  /** Times the noise: root mean square over the windows that lie here. */
  times: number;
  /** The largest of the windows' significances, in standard deviations. */
  significance: number;
  windows: number;
  /** Windows beyond what chance does. */
  beyond: number;
  /** 0 for noise, to 4. */
  level: number;
}

export interface MapRow {
  joint: number;
  phase: Phase;
  /** One a column; null where the joint is not in this phase then. */
  cells: readonly (MapCell | null)[];
}

export interface DisagreementMap {
  /** s: one more than there are columns. */
  edges: readonly number[];
  rows: readonly MapRow[];
  joints: readonly number[];
}

/** The level of a cell that is off by so many times its noise. */
export function levelOf(times: number): number {
  return LEVELS.findIndex((limit) => times <= limit);
}

/** What a level means: "up to 2 times noise". */
export function levelName(level: number): string {
  if (level === LEVELS.length - 1) return `over ${LEVELS[LEVELS.length - 2]}×`;
  return level === 0 ? `noise, to ${LEVELS[0]}×` : `to ${LEVELS[level]}×`;
}

/**
 * The map of one trace in at most so many columns. Phases that do not occur have no row. `chance`: significance beyond
 * which a window counts.
 */
export function disagreementMap(
  cells: readonly PhaseCell[],
  trace: number,
  columns: number,
  chance: number,
): DisagreementMap {
  const own = cells.filter((cell) => cell.trace === trace);
  if (own.length === 0) return { edges: [], rows: [], joints: [] };
  const begin = Math.min(...own.map((cell) => cell.start));
  const end = Math.max(...own.map((cell) => cell.end));
  const shortest = Math.min(...own.map((cell) => cell.end - cell.start));
  const count = Math.max(1, Math.min(columns, Math.round((end - begin) / shortest)));
  const width = (end - begin) / count;
  const edges = Array.from({ length: count + 1 }, (_, index) => begin + index * width);
  const joints = [...new Set(own.map((cell) => cell.joint))].sort((one, other) => one - other);
  const phases = PHASES.filter((phase) => own.some((cell) => cell.phase === phase));
  const places = new Map<string, PhaseCell[]>();
  for (const cell of own) {
    const column = Math.min(count - 1, Math.floor(((cell.start + cell.end) / 2 - begin) / width));
    const key = `${cell.joint} ${cell.phase} ${column}`;
    places.set(key, [...(places.get(key) ?? []), cell]);
  }
  const rows = joints.flatMap((joint) =>
    phases.map((phase) => ({
      joint,
      phase,
      cells: Array.from({ length: count }, (_, column) =>
        merged(places.get(`${joint} ${phase} ${column}`) ?? [], chance),
      ),
    })),
  );
  return { edges, rows, joints };
}

/** Round moments (s) within the map, at most so many. */
export function timeTicks(edges: readonly number[], most: number): number[] {
  const begin = edges[0] ?? 0;
  const end = edges.at(-1) ?? 0;
  if (!(end > begin)) return [];
  const power = 10 ** Math.floor(Math.log10((end - begin) / most));
  const step = power * ([1, 2, 5, 10].find((one) => (end - begin) / (one * power) < most) ?? 10);
  const first = Math.ceil(begin / step - 1e-9);
  const count = Math.floor((end + 1e-9 * step) / step) - first + 1;
  return Array.from({ length: count }, (_, index) => Number(((first + index) * step).toPrecision(12)));
}

function merged(windows: readonly PhaseCell[], chance: number): MapCell | null {
  if (windows.length === 0) return null;
  const length = (one: PhaseCell): number => one.end - one.start;
  const whole = windows.reduce((sum, one) => sum + length(one), 0);
  const square = windows.reduce((sum, one) => sum + one.mean_square * length(one), 0) / whole;
  const times = Math.sqrt(square);
  return {
    start: Math.min(...windows.map((one) => one.start)),
    end: Math.max(...windows.map((one) => one.end)),
    times,
    significance: Math.max(...windows.map((one) => one.significance)),
    windows: windows.length,
    beyond: windows.filter((one) => one.significance > chance).length,
    level: levelOf(times),
  };
}

export interface PhaseSummary extends MapCell {
  joint: number;
  phase: Phase;
  /** Of the window that is furthest off. */
  worst: number;
  worstAt: number;
}

/** The map as a table: joint and phase, over all the time. */
export function phaseSummaries(
  cells: readonly PhaseCell[],
  trace: number,
  chance: number,
): readonly PhaseSummary[] {
  const map = disagreementMap(cells, trace, 1, chance);
  return map.rows.flatMap((row) => {
    const whole = row.cells[0];
    if (whole === null || whole === undefined) return [];
    const own = cells.filter(
      (cell) => cell.trace === trace && cell.joint === row.joint && cell.phase === row.phase,
    );
    const worst = own.reduce((most, cell) => (cell.mean_square > most.mean_square ? cell : most));
    return [
      {
        ...whole,
        joint: row.joint,
        phase: row.phase,
        worst: Math.sqrt(worst.mean_square),
        worstAt: worst.start,
      },
    ];
  });
}
