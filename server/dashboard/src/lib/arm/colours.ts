/** Colours of the 3-D view. A canvas does not follow the style sheet: they are read from it anew when the theme changes. */

export interface ArmColours {
  readonly joints: readonly string[];
  readonly body: string;
  readonly ground: string;
  readonly grid: string;
  readonly shadow: string;
  readonly ghost: string;
  readonly trail: string;
  readonly outside: string;
  readonly stale: string;
}
