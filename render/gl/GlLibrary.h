#pragma once
/** @file
A shared library opened at run time. Internal to the renderer. **/

#include <string>
#include <vector>

namespace simflex {

class GlLibrary {
public:
    /** Opens the library named by the environment variable, or the first of `names` that exists. It
    stays open for the life of the process: its worker threads outlive a context.
    @throws std::runtime_error naming library, Debian package and the loader's reason. **/
    GlLibrary(const char* environmentVariable, const std::vector<const char*>& names,
              const char* package);

    /** @throws std::runtime_error naming library and function. **/
    template <class Function>
    void load(const char* symbol, Function& function) const {
        function = reinterpret_cast<Function>(find(symbol));
    }

private:
    void* find(const char* symbol) const;

    std::string name;
    void* handle = nullptr;
};

}  // namespace simflex
