#pragma once
/** @file
Restrictions on untrusted programs, enforced by the Linux kernel's Landlock and seccomp. They need
neither privileges nor other programs, and work in containers and changed roots.

A program in the sandbox
- cannot run other programs, except through the system's loader, which it needs itself and which
  stays in the same sandbox,
- opens only the files that are readable below, and creates, changes and removes files only in one
  folder,
- has no network, cannot signal or trace other processes or change their limits and priorities, and
  cannot change modes, owners or times of files.

Names, sizes and times of files are not hidden, and processor time, memory and disk are not
limited. **/

#include <string>
#include <vector>

namespace simflex {

struct Sandbox {
    std::string program;                ///< path of the only program that may run
    std::vector<std::string> readable;  ///< files, and folders with all their contents
    std::string writable;               ///< one folder with all its contents
};

/** Returns the folders of system libraries and their data. **/
std::vector<std::string> listSystemFolders();

/** Returns why this system cannot enforce a sandbox, "" if it can. **/
std::string findSandboxObstacle();

/** Restricts the calling thread and everything it starts from now on, irrevocably.
@throws std::runtime_error if the system cannot enforce it. **/
void enterSandbox(const Sandbox& sandbox);

}  // namespace simflex
