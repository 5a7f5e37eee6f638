#include <gmock/gmock.h>

#include <cstdlib>
#include <functional>

#include "simflex/base/ZipFile.h"
#include "support/TestFolder.h"

namespace simflex {
namespace {

using ::testing::HasSubstr;
namespace fs = std::filesystem;

class ZipFileTest : public ::testing::Test {
protected:
    std::string path(const std::string& name) const { return folder / name; }

    void runPython(const std::string& program) {
        testing::writeText(path("program.py"), "import zipfile\n" + program);
        ASSERT_EQ(
            std::system(("cd '" + folder.path() + "' && /usr/bin/python3 program.py").c_str()), 0);
    }

    std::string unpack(const std::string& name) {
        try {
            unpackZip(path(name), folder.makeFolder("place"));
        } catch (const std::runtime_error& error) {
            return error.what();
        }
        return "";
    }

    testing::TestFolder folder;
};

TEST_F(ZipFileTest, ArchivesAreReadByOthersAndTheirsByUs) {
    ZipWriter zip(path("a.zip"));
    const std::string large(100000, 'x');
    zip.add("folder/large.txt", large);
    zip.add("empty", "");
    zip.add("größe", "stored", ZipMethod::Stored);
    zip.finish();
    runPython(
        "z = zipfile.ZipFile('a.zip')\n"
        "assert z.testzip() is None\n"
        "assert z.namelist() == ['folder/large.txt', 'empty', 'größe'], z.namelist()\n"
        "assert z.read('größe') == b'stored'\n"
        "assert [i.compress_type for i in z.infolist()] == [8, 8, 0]\n"
        "w = zipfile.ZipFile('b.zip', 'w')\n"
        "w.writestr('s', b'stored' * 99)\n"
        "w.writestr('d/', b'')\n"
        "w.writestr('d/e', b'deflated' * 99, zipfile.ZIP_DEFLATED)\n"
        "with w.open('large', 'w', force_zip64=True) as file: file.write(b'64' * 99)\n");
    EXPECT_EQ(unpack("a.zip"), "");
    EXPECT_EQ(testing::readText(path("place/folder/large.txt")), large);
    EXPECT_EQ(unpack("b.zip"), "");
    EXPECT_EQ(testing::readText(path("place/s")).size(), 6u * 99);
    EXPECT_EQ(testing::readText(path("place/d/e")).size(), 8u * 99);
    EXPECT_EQ(testing::readText(path("place/large")).size(), 2u * 99);
}

TEST_F(ZipFileTest, TheSameContentsGiveTheSameBytes) {
    for (const char* name : {"a.zip", "b.zip"}) {
        ZipWriter zip(path(name));
        zip.add("one", "1");
        zip.finish();
    }
    EXPECT_EQ(testing::readText(path("a.zip")), testing::readText(path("b.zip")));
}

TEST_F(ZipFileTest, BombsAreRefusedBeforeTheyAreUnpacked) {
    runPython(
        "w = zipfile.ZipFile('bomb.zip', 'w', zipfile.ZIP_DEFLATED)\n"
        "for i in range(5): w.writestr(str(i), bytes(60 << 20))\n");
    EXPECT_THAT(unpack("bomb.zip"), HasSubstr("bomb.zip' would fill the machine"));
    EXPECT_TRUE(fs::is_empty(path("place")));
}

TEST_F(ZipFileTest, WhatIsNotFinishedLeavesNothing) {
    const std::string place = folder.makeFolder("place");
    { ZipWriter(place + "/a.zip").add("one", "1"); }
    EXPECT_TRUE(fs::is_empty(place));
}

TEST_F(ZipFileTest, ArchivesThatAreDamagedOrMeanNoGoodAreRefusedByName) {
    EXPECT_THAT(unpack("none.zip"), HasSubstr("cannot read '" + path("none.zip")));
    runPython(
        "w = zipfile.ZipFile('outside.zip', 'w')\n"
        "w.writestr('../evil', b'1')\n"
        "w = zipfile.ZipFile('root.zip', 'w')\n"
        "w.writestr('/evil', b'1')\n"
        "w = zipfile.ZipFile('clash.zip', 'w')\n"
        "w.writestr('a', b'1')\n"
        "w.writestr('a/b', b'1')\n"
        "w = zipfile.ZipFile('lzma.zip', 'w')\n"
        "w.writestr('a', b'1' * 99, zipfile.ZIP_LZMA)\n"
        "w = zipfile.ZipFile('good.zip', 'w')\n"
        "w.writestr('a', bytes(range(256)) * 9, zipfile.ZIP_DEFLATED)\n"
        "w.writestr('b', b'stored' * 99)\n"
        "w.close()\n"
        "good = open('good.zip', 'rb').read()\n"
        "def change(name, what):\n"
        "    data = bytearray(good)\n"
        "    for at in (data.find(b'PK\\x03\\x04') + 6, data.find(b'PK\\x01\\x02') + 8): "
        "what(data, at)\n"
        "    open(name, 'wb').write(data)\n"
        "def encrypt(data, at): data[at] |= 1\n"
        "def inflate(data, at): data[at + 16:at + 20] = (2 ** 31).to_bytes(4, 'little')\n"
        "change('encrypted.zip', encrypt)\n"
        "change('bomb.zip', inflate)\n"
        "data = bytearray(good); data[good.find(b'storedstored')] += 1\n"
        "open('changed.zip', 'wb').write(data)\n");
    EXPECT_THAT(unpack("outside.zip"), HasSubstr("outside.zip' would write outside of its folder"));
    EXPECT_THAT(unpack("root.zip"), HasSubstr("root.zip' would write outside of its folder"));
    EXPECT_THAT(unpack("clash.zip"), HasSubstr("clash.zip' cannot be unpacked: 'a/b': Not a"));
    EXPECT_THAT(unpack("lzma.zip"), HasSubstr("lzma.zip' is packed by a method that is not known"));
    EXPECT_THAT(unpack("encrypted.zip"), HasSubstr("encrypted.zip' is encrypted: 'a'"));
    EXPECT_THAT(unpack("bomb.zip"), HasSubstr("'a' cannot be as large as it says"));
    EXPECT_THAT(unpack("changed.zip"), HasSubstr("the checksum of 'b' is wrong"));
    EXPECT_FALSE(fs::exists(path("evil")));
    const std::string good = testing::readText(path("good.zip"));
    for (size_t size = 0; size < good.size(); ++size) {
        testing::writeText(path("cut.zip"), good.substr(0, size));
        EXPECT_THAT(unpack("cut.zip"), HasSubstr("cut.zip'")) << size;
    }
}

}  // namespace
}  // namespace simflex
