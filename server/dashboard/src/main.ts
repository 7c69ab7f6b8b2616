import '@fontsource-variable/inter/wght.css';
import './app.css';
import { askEarly } from './lib/live/asked';
import { keepShell } from './lib/shell';

askEarly();
keepShell();
void import('./app');
