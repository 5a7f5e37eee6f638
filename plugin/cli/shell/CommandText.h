#pragma once
/** @file
Syntax of the prompt: `set joint.bearing.angle 30*deg; run 1   # a comment`.

Words are separated by blanks, commands by semicolons. Blanks, semicolons and hashes are literal
within quotes '…', "…" and brackets; quotes are removed, brackets are kept. A hash at the beginning
of a word starts a comment. **/

#include <string>
#include <vector>

namespace simflex {
namespace cli {

using Words = std::vector<std::string>;

/** Returns the non-empty commands of a line. @throws std::invalid_argument for an unclosed quote or
bracket. **/
std::vector<Words> splitCommands(const std::string& line);

/** The command being typed. **/
struct UnfinishedCommand {
    Words words;       ///< the complete ones
    std::string word;  ///< last word as typed so far, without its quote
    char quote = 0;    ///< open quote of the last word, if any
    bool isComment = false;
};
UnfinishedCommand splitUnfinished(const std::string& text);

/** Returns the items of "[a, b, c]", or the whole text as a single item. **/
std::vector<std::string> splitList(const std::string& text);

/** Adds quotes if splitCommands() would otherwise not return the same word. **/
std::string quoteWord(const std::string& word);

}  // namespace cli
}  // namespace simflex
