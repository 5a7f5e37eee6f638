#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdint>
#include <cstring>
#include <functional>
#include <limits>
#include <sstream>
#include <stdexcept>
#include <string>
#include <vector>

#include "simflex/base/Archive.h"

namespace simflex {
namespace {

using ::testing::HasSubstr;

struct Contents {
    double number = 0;
    int index = 0, count = 0;
    bool isSet = false;
    std::string text;
    std::vector<double> numbers;
    std::vector<std::int64_t> integers;
    std::vector<std::string> texts;
    std::vector<std::vector<double>> rows;

    void visit(Archive& archive) {
        archive.visit(number, isSet, text, numbers, integers, texts, rows);
        archive.visitWithin(index, -1, 5, "the index");
        archive.visitCount(count);
    }
};

Contents makeContents() {
    return {0.1, -1, 7, true, std::string("a\0b", 3), {1, 2}, {-3}, {"", "two"}, {{}, {1, 2, 3}}};
}

std::string write(Contents contents) {
    Archive archive;
    contents.visit(archive);
    return archive.getBytes();
}

std::string messageOf(const std::function<void()>& work) {
    try {
        work();
    } catch (const std::runtime_error& error) {
        return error.what();
    }
    return "";
}

TEST(Archive, ReadsWhatItWrote) {
    Archive archive(write(makeContents()));
    Contents read;
    read.visit(archive);
    archive.requireEnd();
    EXPECT_EQ(read.text, std::string("a\0b", 3));
    EXPECT_EQ(read.rows, makeContents().rows);
    EXPECT_EQ(read.index, -1);
    EXPECT_EQ(read.count, 7);
    EXPECT_EQ(write(read), write(makeContents()));
}

TEST(Archive, RefusesBytesThatAreCutOffAnywhereOrTooMany) {
    const std::string whole = write(makeContents());
    for (size_t size = 0; size < whole.size(); ++size) {
        Archive archive(whole.substr(0, size));
        Contents read;
        EXPECT_EQ(messageOf([&] { read.visit(archive); }), "it ends early") << size;
    }
    Archive archive(whole + "xx");
    Contents read;
    read.visit(archive);
    EXPECT_EQ(messageOf([&] { archive.requireEnd(); }), "it holds 2 bytes too many");
}

TEST(Archive, AskedForMoreThanThereIsItTakesNoMemory) {
    for (const std::uint64_t size :
         {std::uint64_t(3), std::uint64_t(1) << 40, std::numeric_limits<std::uint64_t>::max()}) {
        const auto refuses = [size](auto value) {
            std::string bytes(16, '\0');
            std::memcpy(bytes.data(), &size, sizeof size);
            Archive archive(bytes);
            return messageOf([&] { archive.visit(value); }) == "it ends early";
        };
        EXPECT_TRUE(refuses(std::vector<double>()));
        EXPECT_TRUE(refuses(std::vector<std::string>()));
        EXPECT_TRUE(refuses(std::vector<std::vector<double>>()));
        EXPECT_EQ(refuses(std::string()), size > 8);
    }
}

TEST(Archive, NumbersOutsideTheirRangeAreRefused) {
    Contents contents;
    contents.index = 6;
    Archive archive(write(contents));
    EXPECT_EQ(messageOf([&] { contents.visit(archive); }), "the index is 6; it must be -1 to 5");
    for (const std::int64_t count : {std::int64_t(-1), std::int64_t(1) << 31}) {
        Archive counts(std::string(reinterpret_cast<const char*>(&count), sizeof count));
        int read = 0;
        EXPECT_THAT(messageOf([&] { counts.visitCount(read); }), HasSubstr("a number of things"));
    }
}

TEST(Archive, FilesOfAnotherKindOrVersionCutOffOrDamagedAreRefused) {
    std::ostringstream out;
    writeArchive(out, "list of things", 3, "contents");
    const std::string whole = out.str();
    const auto read = [](const std::string& bytes, const std::string& kind, std::uint32_t version) {
        std::istringstream in(bytes);
        return readArchive(in, kind, version);
    };
    EXPECT_EQ(read(whole, "list of things", 3), "contents");
    EXPECT_EQ(messageOf([&] { read(whole, "list", 3); }), "it is no list");
    EXPECT_EQ(messageOf([&] { read(whole, "list of things", 2); }),
              "its format has version 3, this simflex reads 2: a newer simflex is needed");
    for (size_t size = 0; size < whole.size(); ++size)
        EXPECT_NE(messageOf([&] { read(whole.substr(0, size), "list of things", 3); }), "") << size;
    for (size_t at = 0; at < whole.size(); ++at) {
        std::string damaged = whole;
        damaged[at] = char(damaged[at] ^ 4);
        EXPECT_NE(messageOf([&] { read(damaged, "list of things", 3); }), "") << at;
    }
}

}  // namespace
}  // namespace simflex
