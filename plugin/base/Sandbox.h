#pragma once
/** @file
What a program that is not trusted may do. Landlock and seccomp of the Linux kernel see to it: they
need no privileges, no other program, and work in containers and changed roots.

A program in the sandbox

- runs no other program; what it loads by the system's loader, which it needs itself, runs in the
  same sandbox,
- opens only what is readable below, and makes, changes and removes files only in one folder,
- has no network, sends no signals to other processes, traces them not and changes neither their
  limits nor their priorities, changes no modes, owners or times of files.

Names, sizes and times of files are not hidden from it, nor are its processor time, memory and disk
limited. **/

#include <string>
#include <vector>

namespace simflex {

struct Sandbox {
    std::string program;                ///< what may be run: its path
    std::vector<std::string> readable;  ///< files, and folders with all that is in them
    std::string writable;               ///< a folder, with all that is in it
};

/** Where the programs' libraries and their data are. **/
std::vector<std::string> listSystemFolders();

/** Why this system cannot keep a program in a sandbox; empty: it can. **/
std::string findSandboxObstacle();

/** Shuts the calling thread in, and all that it starts from now on. There is no way back.
@throws std::runtime_error if the system cannot. **/
void enterSandbox(const Sandbox& sandbox);

}  // namespace simflex
