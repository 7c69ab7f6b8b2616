/**
 * A layout of the Live page: which panels, where and how large. Pure: read from a file, a link or this browser, so
 * everything is checked. Places are columns and rows of a grid with COLUMNS columns; the order of the panels is their
 * order on a narrow screen.
 */

import { SIGNALS, type Signal } from '../live/recording';

export const COLUMNS = 12;
export const FORMAT = 'ma2000-layout';

const MOST_PANELS = 40;
const MOST_ROWS = 200;
const LONGEST_NAME = 60;
const LONGEST_TEXT = 4000;

/** Of each kind: its name, its first size, its smallest size. */
export const KINDS = {
  charts: { title: 'All charts', w: 8, h: 15, least: [4, 6] },
  chart: { title: 'Chart', w: 4, h: 5, least: [2, 3] },
  number: { title: 'Number', w: 2, h: 4, least: [1, 2] },
  arm: { title: 'Arm in 3-D', w: 4, h: 8, least: [3, 5] },
  table: { title: 'Numbers of all joints', w: 4, h: 6, least: [3, 3] },
  link: { title: 'Link', w: 4, h: 8, least: [3, 3] },
  hand: { title: 'By hand', w: 8, h: 3, least: [4, 2] },
  camera: { title: 'Camera', w: 4, h: 7, least: [2, 3] },
  console: { title: 'Console', w: 8, h: 8, least: [4, 6] },
  faults: { title: 'Faults', w: 4, h: 5, least: [3, 3] },
  notes: { title: 'Notes', w: 4, h: 4, least: [2, 2] },
  plugin: { title: 'Plug-in', w: 4, h: 5, least: [2, 2] },
} as const satisfies Record<
  string,
  { title: string; w: number; h: number; least: readonly [number, number] }
>;

export type Kind = keyof typeof KINDS;

export interface Place {
  /** Of the left upper corner, from 0. */
  x: number;
  y: number;
  w: number;
  h: number;
}

export interface LayoutPanel extends Place {
  /** Of this page alone. */
  id: string;
  kind: Kind;
  /** Of a chart and a number. */
  signal?: Signal;
  /** From 1: of a chart those that it draws (all that are drawn, if there are none); of a number the first. */
  joints?: readonly number[];
  /** Of notes. */
  text?: string;
  /** Of a plug-in's panel: its title. */
  of?: string;
}

export interface Layout {
  name: string;
  panels: readonly LayoutPanel[];
}

/** Says in one line what is wrong with a layout. */
export class LayoutError extends Error {}

let made = 0;

/** A panel with an id of its own. */
export function withId(panel: Omit<LayoutPanel, 'id'>): LayoutPanel {
  made += 1;
  return { ...panel, id: `panel-${made}` };
}

/** What everybody begins with. */
export const STANDARD: Layout = {
  name: 'Standard',
  panels: [
    withId({ kind: 'arm', x: 8, y: 0, w: 4, h: 8 }),
    withId({ kind: 'table', x: 8, y: 8, w: 4, h: 6 }),
    withId({ kind: 'hand', x: 0, y: 15, w: 8, h: 3 }),
    withId({ kind: 'charts', x: 0, y: 0, w: 8, h: 15 }),
    withId({ kind: 'link', x: 8, y: 14, w: 4, h: 8 }),
  ],
};

/** The same place, within the grid and not smaller than its kind allows. */
export function within(kind: Kind, place: Place): Place {
  const [leastW, leastH] = KINDS[kind].least;
  const w = Math.min(COLUMNS, Math.max(leastW, place.w));
  const h = Math.min(MOST_ROWS, Math.max(leastH, place.h));
  return { x: Math.min(COLUMNS - w, Math.max(0, place.x)), y: Math.max(0, place.y), w, h };
}

/** A new panel of a kind, in the first place that is free: the highest, of those the leftmost. */
export function addedPanel(
  panels: readonly LayoutPanel[],
  kind: Kind,
  more: Partial<LayoutPanel> = {},
): LayoutPanel {
  const { w, h } = KINDS[kind];
  const isFree = (x: number, y: number): boolean =>
    panels.every((one) => one.x + one.w <= x || x + w <= one.x || one.y + one.h <= y || y + h <= one.y);
  let [x, y] = [0, 0];
  while (!isFree(x, y)) [x, y] = x + w < COLUMNS ? [x + 1, y] : [0, y + 1];
  const options: Partial<LayoutPanel> =
    kind === 'number' ? { signal: 'position', joints: [1] } : kind === 'chart' ? { signal: 'position' } : {};
  return withId({ kind, x, y, w, h, ...options, ...more });
}

/** The panel one place earlier (-1) or later (1) in the order of narrow screens. */
export function movedInOrder(panels: readonly LayoutPanel[], id: string, by: -1 | 1): LayoutPanel[] {
  const from = panels.findIndex((one) => one.id === id);
  const to = Math.min(panels.length - 1, Math.max(0, from + by));
  const rest = panels.filter((one) => one.id !== id);
  return [...rest.slice(0, to), panels[from]!, ...rest.slice(to)];
}

/** As a file has it. */
export function written(layout: Layout): string {
  const panels = layout.panels.map(({ id: _, ...panel }) => panel);
  return JSON.stringify({ format: FORMAT, name: layout.name, panels });
}

/** Reads what `written` has made, or what others have changed since. Throws a LayoutError. */
export function layoutOf(text: string): Layout {
  let found: unknown;
  try {
    found = JSON.parse(text);
  } catch {
    throw new LayoutError('This is no layout: it is no JSON');
  }
  const file = (found ?? {}) as Record<string, unknown>;
  if (file['format'] !== FORMAT)
    throw new LayoutError(`This is no layout: its "format" has to be "${FORMAT}"`);
  const name = typeof file['name'] === 'string' ? file['name'].trim().slice(0, LONGEST_NAME) : '';
  const panels = file['panels'];
  if (!Array.isArray(panels) || panels.length > MOST_PANELS)
    throw new LayoutError(`"panels" has to be a list of at most ${MOST_PANELS} panels`);
  return { name: name || 'Layout', panels: panels.map(panelOf) };
}

function panelOf(found: unknown, index: number): LayoutPanel {
  const one = (found ?? {}) as Record<string, unknown>;
  const wrong = (what: string): LayoutError => new LayoutError(`Panel ${index + 1}: ${what}`);
  const kind = one['kind'];
  if (typeof kind !== 'string' || !Object.hasOwn(KINDS, kind))
    throw wrong(`its kind is "${String(kind)}", allowed are ${Object.keys(KINDS).join(', ')}`);
  const whole = (key: keyof Place): number => {
    const value = one[key];
    if (typeof value === 'number' && Number.isInteger(value) && value >= 0 && value <= MOST_ROWS)
      return value;
    throw wrong(`"${key}" has to be a whole number from 0 to ${MOST_ROWS}`);
  };
  const place = within(kind as Kind, { x: whole('x'), y: whole('y'), w: whole('w'), h: whole('h') });
  const panel: LayoutPanel = withId({ kind: kind as Kind, ...place });
  const { signal, joints, text, of } = one;
  if (signal !== undefined) {
    if (!SIGNALS.includes(signal as Signal))
      throw wrong(`its signal is "${String(signal)}", allowed are ${SIGNALS.join(', ')}`);
    panel.signal = signal as Signal;
  }
  if (joints !== undefined) {
    if (
      !Array.isArray(joints) ||
      !joints.every((joint) => Number.isInteger(joint) && joint >= 1 && joint <= 99)
    )
      throw wrong('"joints" has to be a list of joints, from 1');
    panel.joints = joints as number[];
  }
  if (typeof text === 'string') panel.text = text.slice(0, LONGEST_TEXT);
  if (typeof of === 'string') panel.of = of.slice(0, LONGEST_NAME);
  return panel;
}

async function through(data: Blob, stream: GenericTransformStream): Promise<Uint8Array> {
  return new Uint8Array(await new Response(data.stream().pipeThrough(stream)).arrayBuffer());
}

/** A layout as a part of an address. */
export async function packed(layout: Layout): Promise<string> {
  const bytes = await through(new Blob([written(layout)]), new CompressionStream('deflate-raw'));
  return btoa(String.fromCharCode(...bytes))
    .replaceAll('+', '-')
    .replaceAll('/', '_')
    .replaceAll('=', '');
}

/** What `packed` has made. Throws a LayoutError. */
export async function unpacked(part: string): Promise<Layout> {
  let text: string;
  try {
    const bytes = Uint8Array.from(atob(part.replaceAll('-', '+').replaceAll('_', '/')), (one) =>
      one.charCodeAt(0),
    );
    text = new TextDecoder().decode(await through(new Blob([bytes]), new DecompressionStream('deflate-raw')));
  } catch {
    throw new LayoutError('The link is not whole: ask for it again');
  }
  return layoutOf(text);
}
