#pragma once
/** @file
Limits chains of entries of a file that name each other, where their values are nested as well, as
functions that call each other: circles and long chains are refused. A chain counts the same
whatever the order of its entries. Where values are not nested: see DependencyOrder.h.

    ReferenceChain chain{"probes", "the expression depends on itself"};
    void resolve(name) {
        if (is resolved) return chain.repeat(name, fail);
        const ReferenceChain::Link link(chain, name, fail);
        for (each entry that it names) resolve(it);
    }  **/

#include <algorithm>
#include <cstddef>
#include <map>
#include <string>
#include <utility>
#include <vector>

namespace simflex {

class ReferenceChain {
public:
    /** Most entries in a row: bounds the stack of the resolution, and of what follows the same
    chain later, such as evaluation and destruction. **/
    static constexpr std::size_t Longest = 1000;

    /** @param entries  plural
    @param circle  how a message on a circle begins
    @param advice  how it ends **/
    ReferenceChain(std::string entries, std::string circle, std::string advice = "")
        : m_entries(std::move(entries)), m_circle(std::move(circle)), m_advice(std::move(advice)) {}

    /** An entry that is being resolved, named by the one begun before it. **/
    class Link {
    public:
        /** @param fail  called with what is wrong; must throw **/
        template <class Fail>
        Link(ReferenceChain& chain, const std::string& name, const Fail& fail) : m_chain(chain) {
            if (chain.m_places.count(name)) fail(chain.m_circle + ": " + chain.writeCircle(name));
            chain.checkLength(name, fail);
            chain.m_places[name] = chain.m_open.size();
            chain.m_open.push_back(name);
        }
        ~Link() {
            const std::string name = std::move(m_chain.m_open.back());
            m_chain.m_open.pop_back();
            m_chain.m_places.erase(name);
            m_chain.m_below[name];
            m_chain.note(name);
        }
        Link(const Link&) = delete;
        Link& operator=(const Link&) = delete;

    private:
        ReferenceChain& m_chain;
    };

    /** An entry resolved before is named again. **/
    template <class Fail>
    void repeat(const std::string& name, const Fail& fail) {
        if (m_open.empty()) return;
        checkLength(name, fail);
        note(name);
    }

private:
    /** The longest chain below an entry: of how many, and the first of them. **/
    struct Below {
        std::size_t number = 0;
        std::string next;
    };

    template <class Fail>
    void checkLength(const std::string& name, const Fail& fail) const {
        const auto below = m_below.find(name);
        const std::size_t number = below == m_below.end() ? 0 : below->second.number;
        if (m_open.size() + 1 + number > Longest) fail(writeLong(name));
    }

    /** The entry begun last names one that is resolved. **/
    void note(const std::string& name) {
        if (m_open.empty()) return;
        const std::size_t number = m_below[name].number + 1;
        Below& own = m_below[m_open.back()];
        if (number > own.number) own = {number, name};
    }

    std::string writeCircle(const std::string& name) const {
        std::string circle;
        for (std::size_t i = m_places.at(name); i < m_open.size(); ++i)
            circle += "'" + m_open[i] + "' → ";
        return circle + "'" + name + "'" + m_advice;
    }

    std::string writeLong(const std::string& last) const {
        constexpr std::size_t Shown = 4;
        std::vector<std::string> first(
            m_open.begin(), m_open.begin() + std::ptrdiff_t(std::min(Shown, m_open.size())));
        for (std::string name = last; first.size() < Shown && !name.empty();) {
            first.push_back(name);
            const auto below = m_below.find(name);
            name = below == m_below.end() ? "" : below->second.next;
        }
        std::string text = "more than " + std::to_string(Longest) + ' ' + m_entries +
                           " refer to each other in a row: ";
        for (const std::string& name : first) text += "'" + name + "' → ";
        return text + "…";
    }

    std::string m_entries, m_circle, m_advice;
    std::vector<std::string> m_open;
    std::map<std::string, std::size_t> m_places;  ///< in m_open
    std::map<std::string, Below> m_below;         ///< of entries begun
};

}  // namespace simflex
