#pragma once
/** @file
Talking to the program gnuplot; used by Plot and HeatMap. **/

#include <string>

namespace simflex::examples {

bool isGnuplotAvailable();

/** Text as a gnuplot string: single quotes, doubled inside. **/
std::string quoteForGnuplot(const std::string& text);

/** Runs a script that draws `file`. @throws std::runtime_error when gnuplot fails. **/
void runGnuplot(const std::string& script, const std::string& file);

}  // namespace simflex::examples
