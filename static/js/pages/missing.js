// An address that leads nowhere.

import { boot, showFault } from "../shell.js";

const shell = await boot();
showFault(shell.main, new Error(`There is nothing at ${location.pathname}. The address may be mistyped, or what was here has been taken away.`));
