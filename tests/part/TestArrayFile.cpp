#include <gtest/gtest.h>

#include <cstdlib>
#include <map>

#include "simflex/part/ArrayFile.h"
#include "support/TestFolder.h"

namespace simflex {
namespace {

TEST(ArrayFile, TextsInAnyScriptAreReadByNumPyAndSciPy) {
    const testing::TestFolder folder;
    FileArray names;
    names.name = "names";
    names.texts = {"tip", "größe", "模態", ""};
    writeArrayFile(folder / "a.mat", {names, makeArray("K", 2, 1, {1, 2})});
    names.texts.push_back("🦀");  // two units of UTF-16, for which SciPy has no room
    writeArrayFile(folder / "a.npz", {names, makeArray("K", 2, 1, {1, 2})});
    testing::writeText(folder / "program.py",
                       "import numpy, scipy.io\n"
                       "names = ['tip', 'größe', '模態', '']\n"
                       "npz = numpy.load('a.npz')\n"
                       "mat = scipy.io.loadmat('a.mat', uint16_codec='utf-16')\n"
                       "assert npz['names'].tolist() == names + ['🦀'], npz['names']\n"
                       "found = [''.join(t[0]) for t in mat['names']]\n"
                       "assert found == names, found\n"
                       "assert (npz['K'] == mat['K']).all() and mat['K'].shape == (2, 1)\n");
    EXPECT_EQ(std::system(("cd '" + folder.path() + "' && /usr/bin/python3 program.py").c_str()),
              0);
}

TEST(ArrayFile, NumbersOfEitherByteOrderAreRead) {
    const testing::TestFolder folder;
    testing::writeText(
        folder / "program.py",
        "import numpy\n"
        "values = numpy.array([[1.5, -2, 3e200], [4, 5, 6]])\n"
        "numpy.savez('a.npz', little=values.astype('<f8'), big=values.astype('>f8'),"
        " columns=numpy.asfortranarray(values).astype('>f8'),"
        " set=numpy.array([3, -1000], dtype='>i4'), bytes=numpy.arange(3, dtype='u1'))\n");
    ASSERT_EQ(std::system(("cd '" + folder.path() + "' && /usr/bin/python3 program.py").c_str()),
              0);
    std::map<std::string, std::vector<double>> values;
    for (const FileArray& array : readArrayFile(folder / "a.npz"))
        values[array.name] = array.values;
    EXPECT_EQ(values["little"], (std::vector<double>{1.5, 4, -2, 5, 3e200, 6}));
    EXPECT_EQ(values["big"], values["little"]);
    EXPECT_EQ(values["columns"], values["little"]);
    EXPECT_EQ(values["set"], (std::vector<double>{3, -1000}));
    EXPECT_EQ(values["bytes"], (std::vector<double>{0, 1, 2}));
}

}  // namespace
}  // namespace simflex
