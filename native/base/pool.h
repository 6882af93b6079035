// Working memory that is used again and again.
#pragma once

#include <memory>
#include <mutex>
#include <vector>

namespace beamspread {

// Lends objects to work items, as many at once as there are threads at work; they come back with what they held.
template <class T>
class Pool {
public:
    class Lease {
    public:
        explicit Lease(Pool& pool) : m_pool(pool), m_object(pool.take()) {}
        Lease(const Lease&) = delete;
        Lease& operator=(const Lease&) = delete;
        ~Lease() { m_pool.give_back(std::move(m_object)); }
        T& operator*() const { return *m_object; }

    private:
        Pool& m_pool;
        std::unique_ptr<T> m_object;
    };

    Lease lend() { return Lease(*this); }

private:
    std::unique_ptr<T> take()
    {
        const std::lock_guard lock(m_mutex);
        if (m_free.empty())
            return std::make_unique<T>();
        std::unique_ptr<T> object = std::move(m_free.back());
        m_free.pop_back();
        return object;
    }

    void give_back(std::unique_ptr<T> object)
    {
        const std::lock_guard lock(m_mutex);
        m_free.push_back(std::move(object));
    }

    std::mutex m_mutex;
    std::vector<std::unique_ptr<T>> m_free;
};

}  // namespace beamspread
