#pragma once
/** @file
Entries of Nastran bulk data: small field (8 columns), large field (16 columns, NAME*) and free
field (commas), with their continuations. Internal to fe. **/

#include <set>
#include <string>
#include <vector>

#include "simflex/part/TextLines.h"

namespace simflex {

struct BulkCard {
    std::string name;                 ///< upper case, without *
    std::vector<std::string> fields;  ///< field 2 onwards, blanks trimmed; padded to whole lines
    int line = 0;                     ///< of its first line

    /** Field by its place behind the name, 0-based; empty if there are fewer. **/
    std::string_view field(size_t place) const {
        return place < fields.size() ? std::string_view(fields[place]) : std::string_view();
    }
};

/** Walks through the entries of some names; lines of all others are passed over. Without names
through all entries. **/
class BulkCards {
public:
    BulkCards(const std::string& path, const std::string& kind, std::set<std::string> names);

    /** Reads the next entry. @returns false at the end. **/
    bool next(BulkCard& card);

    /** The file; where() is that of the entry's last line. **/
    const TextLines& lines() const { return m_lines; }
    [[noreturn]] void refuse(const BulkCard& card, const std::string& why) const;

    /** Numbers as Nastran writes them: 1.5-3 is 1.5e-3; an empty field is 0. **/
    double parseNumber(const BulkCard& card, std::string_view field, const char* what) const;
    int parseInteger(const BulkCard& card, std::string_view field, const char* what) const;

private:
    TextLines m_lines;
    std::set<std::string> m_names;
};

}  // namespace simflex
