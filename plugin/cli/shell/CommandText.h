#pragma once
/** @file
How the prompt reads text: `set joint.bearing.angle 30*deg; run 1   # a comment`.

Words are separated by blanks, commands by semicolons. Quotes '…' and "…" and brackets keep blanks,
semicolons and hashes; quotes are taken off, brackets stay. A hash at the beginning of a word begins
a comment. **/

#include <string>
#include <vector>

namespace simflex {
namespace cli {

using Words = std::vector<std::string>;

/** The commands of a line; none is empty. @throws std::invalid_argument for a quote or bracket that
is not closed. **/
std::vector<Words> splitCommands(const std::string& line);

/** The command that is being typed. **/
struct UnfinishedCommand {
    Words words;       ///< the complete ones
    std::string word;  ///< the last one as far as it was typed, without its quote
    char quote = 0;    ///< in which it stands, if any
    bool isComment = false;
};
UnfinishedCommand splitUnfinished(const std::string& text);

/** Items of "[a, b, c]", or the whole text as one. **/
std::vector<std::string> splitList(const std::string& text);

/** With quotes if splitCommands() would not give it back as one word otherwise. **/
std::string quoteWord(const std::string& word);

}  // namespace cli
}  // namespace simflex
