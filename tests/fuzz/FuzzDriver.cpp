/** @file
Runs a fuzz target without libFuzzer: `fuzz_X CORPUS [MUTATIONS]` runs every file of the corpus and
a fixed sequence of mutations. Memory is limited to detect small files that request large
allocations, except under sanitizers, which reserve terabytes of address space. **/

#include <sys/resource.h>

#include <algorithm>
#include <random>
#include <sstream>

#include "Fuzz.h"

#ifndef __has_feature
#define __has_feature(feature) 0
#endif
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__) || \
    __has_feature(address_sanitizer) || __has_feature(thread_sanitizer)
#define SIMFLEX_HAS_SANITIZER 1
#else
#define SIMFLEX_HAS_SANITIZER 0
#endif

namespace {

constexpr rlim_t kMostMemory = rlim_t(2) << 30;
constexpr int kMutations = 3000;

std::string readFile(const std::filesystem::path& path) {
    std::ifstream in(path, std::ios::binary);
    std::stringstream text;
    text << in.rdbuf();
    return text.str();
}

using Random = std::mt19937;

size_t pick(Random& random, size_t count) {
    return count == 0 ? 0 : size_t(random()) % count;
}

/** Returns the start and end of the field (letters, digits, signs) at or after a position. **/
std::pair<size_t, size_t> findField(const std::string& text, size_t at) {
    const char* const separators = " ,\t\n=";
    const size_t begin = std::min(text.find_first_not_of(separators, at), text.size());
    return {begin, std::min(text.find_first_of(separators, begin), text.size())};
}

std::pair<size_t, size_t> findLine(const std::string& text, size_t at) {
    const size_t before = at == 0 ? std::string::npos : text.rfind('\n', at - 1);
    const size_t begin = before == std::string::npos ? 0 : before + 1;
    return {begin, std::min(text.find('\n', at), text.size() - 1) + 1};
}

void mutate(std::string& text, const std::vector<std::string>& corpus, Random& random) {
    static const char* const values[] = {"0",          "-1",
                                         "2147483647", "-2147483648",
                                         "4294967296", "1e308",
                                         "1e999",      "nan",
                                         "inf",        "1e-320",
                                         "",           "x",
                                         "1.5-3",      "99999999999999999999",
                                         "3",          "1",
                                         ",",          "****",
                                         "1000000000"};
    if (text.empty()) text = "\n";
    const size_t at = pick(random, text.size());
    switch (random() % 8) {
        case 0:
            text[at] = char(random());
            break;
        case 1:
            text[at] = char(text[at] ^ (1 << random() % 8));
            break;
        case 2: {
            const auto [begin, end] = findField(text, at);
            text.replace(begin, end - begin, values[random() % std::size(values)]);
            break;
        }
        case 3: {
            const auto [begin, end] = findLine(text, at);
            text.erase(begin, end - begin);
            break;
        }
        case 4: {
            const auto [begin, end] = findLine(text, at);
            text.insert(begin, text.substr(begin, end - begin));
            break;
        }
        case 5:
            text.resize(at);
            break;
        case 6: {  // a line from another position or file
            const std::string& other = corpus[pick(random, corpus.size())];
            if (other.empty()) break;
            const auto [begin, end] = findLine(other, pick(random, other.size()));
            text.insert(findLine(text, at).first, other.substr(begin, end - begin));
            break;
        }
        default: {
            const auto [begin, end] = findField(text, at);
            const auto [otherBegin, otherEnd] = findField(text, pick(random, text.size()));
            text.replace(begin, end - begin, text.substr(otherBegin, otherEnd - otherBegin));
        }
    }
}

void run(const std::string& input) {
    LLVMFuzzerTestOneInput(reinterpret_cast<const uint8_t*>(input.data()), input.size());
}

}  // namespace

int main(int argc, char** argv) {
    if (argc < 2) {
        std::fprintf(stderr, "usage: %s CORPUS [MUTATIONS]\n", argv[0]);
        return 2;
    }
    const rlimit limit{kMostMemory, kMostMemory};
    if (!SIMFLEX_HAS_SANITIZER) setrlimit(RLIMIT_AS, &limit);
    std::vector<std::filesystem::path> paths;
    for (const auto& entry : std::filesystem::directory_iterator(argv[1]))
        if (entry.is_regular_file()) paths.push_back(entry.path());
    std::sort(paths.begin(), paths.end());
    std::vector<std::string> corpus;
    for (const auto& path : paths) corpus.push_back(readFile(path));
    if (corpus.empty()) {
        std::fprintf(stderr, "%s: the corpus '%s' is empty\n", argv[0], argv[1]);
        return 2;
    }
    for (const std::string& input : corpus) run(input);
    const int numMutations = argc > 2 ? std::atoi(argv[2]) : kMutations;
    for (int k = 0; k < numMutations; ++k) {
        Random random{unsigned(k)};
        std::string input = corpus[size_t(k) % corpus.size()];
        for (unsigned count = 1 + random() % 4; count > 0; --count) mutate(input, corpus, random);
        run(input);
    }
    std::printf("%zu inputs and %d mutations\n", corpus.size(), numMutations);
    return 0;
}
