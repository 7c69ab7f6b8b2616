/** Lines of a chart of traces: measured, set point, simulated; coloured by joint, or by trace where there are several. */

import uPlot from 'uplot';
import type { ChartSeries } from '../../lib/chart';
import { dashesOf } from '../../lib/drawing/dashes';
import { columnOf, startOf, type Signals } from '../../lib/traces/columns';
import type { Simulation } from './simulating.svelte';

const DEGREES = 180 / Math.PI;
const SIMULATED = [2, 3];

/** A trace as it is drawn. */
export interface Drawn {
  readonly name: string;
  readonly signals: Signals;
  readonly simulation: Simulation | null;
  /** Joints that slide: their values are lengths. */
  readonly prismatic: ReadonlySet<number>;
  readonly driveUnit: string;
  /** Positions are drawn less where the trace begins. */
  readonly fromStart: boolean;
}

export interface Lines {
  readonly series: ChartSeries[];
  readonly data: uPlot.AlignedData;
}

type Row = readonly [series: ChartSeries, column: readonly number[]];

/** Value of the trace × this = what is shown: degrees, mm. */
export function scaleOf(drawn: Drawn, joint: number): number {
  return drawn.prismatic.has(joint) ? 1000 : DEGREES;
}

export function unitOf(
  all: readonly Drawn[],
  signal: 'position' | 'error' | 'drive',
  joints: readonly number[],
): string {
  if (signal === 'drive') return [...new Set(all.map((drawn) => drawn.driveUnit))].join(', ');
  const units = all.flatMap((drawn) => joints.map((joint) => (drawn.prismatic.has(joint) ? 'mm' : '°')));
  return [...new Set(units)].join(', ');
}

/** All lines of one signal. `colourOf`: of a joint where one trace is shown, else of a trace (from 1). */
export function linesOf(
  all: readonly Drawn[],
  signal: 'position' | 'error' | 'drive',
  joints: readonly number[],
  colourOf: (number: number) => string,
): Lines {
  const tables: [readonly number[], Row[]][] = all.flatMap((drawn, index) => {
    const rows = joints.flatMap((joint, place) => {
      const dash = dashesOf(index * joints.length + place, all.length * joints.length);
      return rowsOf(drawn, signal, joint, all.length > 1 ? index + 1 : null, colourOf, dash);
    });
    const simulated = joints.flatMap((joint) =>
      simulatedRow(drawn, signal, joint, all.length > 1 ? index + 1 : null, colourOf),
    );
    const tables: [readonly number[], Row[]][] = [[drawn.signals.time, rows]];
    if (drawn.simulation && simulated.length > 0) tables.push([drawn.simulation.time, simulated]);
    return tables;
  });
  const filled = tables.filter(([, rows]) => rows.length > 0);
  const series = filled.flatMap(([, rows]) => rows.map(([one]) => one));
  if (filled.length === 0) return { series, data: [[]] };
  const columns = filled.map(
    ([time, rows]) => [time, ...rows.map(([, column]) => column)] as uPlot.AlignedData,
  );
  return { series, data: columns.length === 1 ? columns[0]! : uPlot.join(columns) };
}

function rowsOf(
  drawn: Drawn,
  signal: 'position' | 'error' | 'drive',
  joint: number,
  trace: number | null,
  colourOf: (number: number) => string,
  dash: number[],
): Row[] {
  const colour = colourOf(trace ?? joint);
  const label = `${trace === null ? '' : `${drawn.name} `}J${joint}`;
  const end = trace === null ? `J${joint}` : String(trace);
  const scale = signal === 'drive' ? 1 : scaleOf(drawn, joint);
  const begin = signal === 'position' ? beginOf(drawn, joint) : 0;
  const column = columnOf(drawn.signals, signal, joint, scale, begin);
  const asked = signal === 'position' ? columnOf(drawn.signals, 'set_point', joint, scale, begin) : null;
  return [
    ...(asked ? [[{ label: `${label} set point`, colour, dash, width: 1.1 }, asked] as const] : []),
    ...(column ? [[{ label: `${label} ${signal}`, colour, end, width: 1.6 }, column] as const] : []),
  ];
}

function simulatedRow(
  drawn: Drawn,
  signal: 'position' | 'error' | 'drive',
  joint: number,
  trace: number | null,
  colourOf: (number: number) => string,
): Row[] {
  const { simulation } = drawn;
  const row = signal === 'position' ? simulation?.position[simulation.joints.indexOf(joint)] : undefined;
  if (row === undefined) return [];
  const [scale, begin] = [scaleOf(drawn, joint), beginOf(drawn, joint)];
  const label = `${drawn.name} J${joint}, simulated`;
  const series = { label, colour: colourOf(trace ?? joint), dash: SIMULATED, width: 2.4 };
  return [[series, row.map((value) => (value - begin) * scale)]];
}

/** What is taken off positions; 0 where they are drawn as they are. */
export function beginOf({ fromStart, signals }: Drawn, joint: number): number {
  return fromStart ? startOf(signals, joint) : 0;
}
