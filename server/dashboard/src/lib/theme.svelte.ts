/** Light or dark: as the system says, or as the user has chosen. Canvases read their colours from here. */

export type Choice = 'system' | 'light' | 'dark';
const KEY = 'ma2000-theme';

/** A report that is shown in a frame of its own may keep nothing. */
function keptChoice(): string | null {
  try {
    return localStorage.getItem(KEY);
  } catch {
    return null;
  }
}

class Theme {
  choice = $state<Choice>('system');
  private systemIsDark = $state(false);
  private told: (shown: 'light' | 'dark') => void = () => {};
  shown: 'light' | 'dark' = $derived(
    this.choice === 'system' ? (this.systemIsDark ? 'dark' : 'light') : this.choice,
  );

  /** `told` hears of every change, and of what is shown at first. */
  start(told: (shown: 'light' | 'dark') => void = () => {}): void {
    this.told = told;
    const system = matchMedia('(prefers-color-scheme: dark)');
    this.systemIsDark = system.matches;
    system.addEventListener('change', (event) => {
      this.systemIsDark = event.matches;
      this.show();
    });
    const kept = keptChoice();
    if (kept === 'light' || kept === 'dark') this.choice = kept;
    this.show();
  }

  choose(choice: Choice): void {
    this.choice = choice;
    if (choice === 'system') localStorage.removeItem(KEY);
    else localStorage.setItem(KEY, choice);
    this.show();
  }

  /** The other one of the two; the user's choice from now on. */
  toggle(): void {
    this.choose(this.shown === 'dark' ? 'light' : 'dark');
  }

  private show(): void {
    document.documentElement.dataset['theme'] = this.shown;
    this.told(this.shown);
  }
}

export const theme = new Theme();

/** The value of a design token (`--ink`), for canvases. Read `theme.shown` in the same effect to hear of changes. */
export function token(name: string): string {
  return getComputedStyle(document.documentElement).getPropertyValue(name).trim();
}

/** The colour of a joint (from 1), the same in charts, tables and 3-D. */
export function jointColour(joint: number): string {
  return token(`--joint-${((joint - 1) % 6) + 1}`);
}
