#pragma once
/** @file
JSON writer.

    Json mode = Json::object();
    mode.add("number", 7).add("frequency", 12.5).add("nodes", std::vector<double>{1, 2});
    std::string text = mode.write(2);   // lines indented by two blanks a level

Numbers are written with 17 digits, so they are read back bit by bit; JSON cannot represent
non-finite numbers, they become null. Lists of plain values are written on one line. Internal. **/

#include <string>
#include <utility>
#include <vector>

namespace simflex {

class Json {
public:
    Json(double value) : Json(value, 17) {}
    Json(double value, int digits);
    Json(int value) : m_text(std::to_string(value)) {}
    Json(bool value) : m_text(value ? "true" : "false") {}
    Json(const std::string& text) : m_text(quote(text)) {}
    Json(const char* text) : Json(std::string(text)) {}
    /** A list of numbers or strings. **/
    template <class List, class = typename List::const_iterator>
    Json(const List& values) : Json('[') {
        for (const auto& value : values) add(Json(value));
    }
    /** A value that is already JSON text. **/
    static Json written(std::string text) {
        Json value = Json::list();
        value.m_bracket = 0;
        value.m_text = std::move(text);
        return value;
    }
    static Json list() { return Json('['); }
    static Json object() { return Json('{'); }

    /** Appends a value to a list, or a member to an object. **/
    Json& add(Json item) { return add("", std::move(item)); }
    Json& add(const std::string& key, Json value) {
        m_items.emplace_back(key, std::move(value));
        return *this;
    }
    void merge(const Json& other) {
        m_items.insert(m_items.end(), other.m_items.begin(), other.m_items.end());
    }
    bool isEmpty() const { return m_items.empty(); }

    /** @param indent  blanks per level **/
    std::string write(int indent) const;

private:
    explicit Json(char bracket) : m_bracket(bracket) {}
    static std::string quote(const std::string& text);
    void write(int indent, int depth, std::string& out) const;

    std::string m_text;
    char m_bracket = 0;  ///< opening bracket of a list or object; 0: a plain value
    std::vector<std::pair<std::string, Json>> m_items;
};

}  // namespace simflex
