/** @file
Prompt text. Quoting a word and parsing it again returns the same word, alone and among others. **/

#include "Fuzz.h"
#include "simflex/cli/shell/CommandTable.h"

using namespace simflex;

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
    const std::string text(reinterpret_cast<const char*>(data), size);
    cli::splitUnfinished(text);
    cli::splitList(text);
    std::vector<cli::Words> commands;
    if (!fuzz::accepts([&] { commands = cli::splitCommands(text); }, fuzz::Names::Anything))
        return 0;
    std::string again;
    for (const cli::Words& words : commands) {
        if (words.empty()) fuzz::fail("an empty command");
        for (const std::string& word : words) again += cli::quoteWord(word) + " ";
        again += ";";
        fuzz::accepts([&] { cli::findCommand(words[0]); }, fuzz::Names::Anything);
    }
    if (cli::splitCommands(again) != commands) fuzz::fail("words that were quoted are others");
    return 0;
}
