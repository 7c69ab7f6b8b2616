/** What each kind of panel is drawn by. Every component gets the machine and its panel. */

import type { Component } from 'svelte';
import type { Machine } from '../../lib/api';
import type { Kind, LayoutPanel } from '../../lib/layout/layout';
import ArmPanel from './ArmPanel.svelte';
import HandPanel from './HandPanel.svelte';
import JointTable from './JointTable.svelte';
import LinkPanel from './LinkPanel.svelte';
import SignalCharts from './SignalCharts.svelte';

export type PanelComponent = Component<{ machine: Machine; panel: LayoutPanel }>;
type Loaded = { default: PanelComponent };

/** A component takes of the machine and the panel what it needs. */
const as = (component: unknown): Loaded => ({ default: component as PanelComponent });
const there = (component: unknown) => (): Loaded => as(component);
const later = (load: () => Promise<{ default: unknown }>) => async (): Promise<Loaded> =>
  as((await load()).default);

/** The standard layout's are there at once; the others are loaded by whoever has one. */
export const LOADED: Readonly<Record<Kind, () => Loaded | Promise<Loaded>>> = {
  charts: there(SignalCharts),
  chart: there(SignalCharts),
  number: later(() => import('./panels/NumberPanel.svelte')),
  arm: there(ArmPanel),
  table: there(JointTable),
  link: there(LinkPanel),
  hand: there(HandPanel),
  camera: later(() => import('./panels/CameraPanel.svelte')),
  console: later(() => import('../console/ConsolePage.svelte')),
  faults: later(() => import('./panels/FaultList.svelte')),
  notes: later(() => import('./panels/NotesPanel.svelte')),
  plugin: later(() => import('./panels/PluginPanel.svelte')),
};
