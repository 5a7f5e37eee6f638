/** @file
The prompt, driven as a user drives it. **/
