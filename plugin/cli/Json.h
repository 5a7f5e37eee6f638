#pragma once
/** @file
Writes JSON text. Numbers carry all 17 digits, so that they read back to the same bits. **/

#include <string>
#include <vector>

namespace simflex {
namespace cli {

class JsonWriter {
public:
    /** Open and close a level; `key` is empty inside an array and for the outermost object. **/
    void beginObject(const std::string& key = "") { begin(key, '{'); }
    void endObject() { end('}'); }
    void beginArray(const std::string& key) { begin(key, '['); }
    void endArray() { end(']'); }

    void add(const std::string& key, const std::string& value) { put(key, quoted(value)); }
    void add(const std::string& key, int value) { put(key, std::to_string(value)); }
    void add(const std::string& key, bool value) { put(key, value ? "true" : "false"); }
    void add(const std::string& key, double value) { put(key, number(value)); }

    /** An array of numbers. **/
    template <class Numbers>
    void add(const std::string& key, const Numbers& values) {
        std::string list;
        for (const double value : values) list += (list.empty() ? "" : ", ") + number(value);
        put(key, "[" + list + "]");
    }
    void add(const std::string& key, const char* value) { add(key, std::string(value)); }
    void add(const std::string& key, const std::vector<std::string>& texts) {
        std::string list;
        for (const std::string& text : texts) list += (list.empty() ? "" : ", ") + quoted(text);
        put(key, "[" + list + "]");
    }

    const std::string& text() const { return _text; }

private:
    void put(const std::string& key, const std::string& value);
    void begin(const std::string& key, char bracket);
    void end(char bracket);
    static std::string quoted(const std::string& value);
    static std::string number(double value);

    std::string _text;
    int _depth = 0;
    bool _first = true;
};

}  // namespace cli
}  // namespace simflex
