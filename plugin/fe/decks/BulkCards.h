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
    std::vector<std::string> fields;  ///< field 2 onwards, trimmed; padded to whole lines
    int line = 0;                     ///< of its first line

    /** Returns a field by its 0-based index after the name; empty if there are fewer. **/
    std::string_view field(size_t place) const {
        return place < fields.size() ? std::string_view(fields[place]) : std::string_view();
    }
};

/** Iterates over the entries with certain names and skips the lines of all others. Without names,
iterates over all entries. **/
class BulkCards {
public:
    BulkCards(const std::string& path, const std::string& kind, std::set<std::string> names);

    /** Reads the next entry. @returns false at the end. **/
    bool next(BulkCard& card);

    /** The file; where() refers to the entry's last line. **/
    const TextLines& lines() const { return m_lines; }
    [[noreturn]] void refuse(const BulkCard& card, const std::string& why) const;

    /** Parse numbers in Nastran's notation: 1.5-3 is 1.5e-3; an empty field is 0. **/
    double parseNumber(const BulkCard& card, std::string_view field, const char* what) const;
    int parseInteger(const BulkCard& card, std::string_view field, const char* what) const;

private:
    TextLines m_lines;
    std::set<std::string> m_names;
};

}  // namespace simflex
