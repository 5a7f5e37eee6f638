#include <gtest/gtest.h>

#include <cstdlib>

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

}  // namespace
}  // namespace simflex
