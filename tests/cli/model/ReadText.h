#pragma once
/** @file
Reads models from texts. **/

#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "simflex/model/file/ModelReader.h"

namespace simflex {
namespace testing {

inline model::ModelValue readModelText(const std::string& text,
                                       const std::vector<std::string>& settings = {}) {
    return readModel({"m.yaml", text, settings});
}

/** The same for the text after a first line `simflex: 1`. **/
inline model::ModelValue readRest(const std::string& text,
                                  const std::vector<std::string>& settings = {}) {
    return readModelText("simflex: 1\n" + text, settings);
}

/** Returns the reader's message for a text that it refuses. **/
inline std::string refuse(const std::string& text, const std::vector<std::string>& settings = {}) {
    try {
        readModelText(text, settings);
    } catch (const ModelError& error) {
        return error.what();
    }
    ADD_FAILURE() << "accepted:\n" << text;
    return "";
}
inline std::string refuseRest(const std::string& text,
                              const std::vector<std::string>& settings = {}) {
    return refuse("simflex: 1\n" + text, settings);
}

}  // namespace testing
}  // namespace simflex
