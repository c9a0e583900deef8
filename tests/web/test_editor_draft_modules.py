"""The modules that keep drafts: differences of documents, limits of number and size, damage."""

from collections.abc import Iterator
from typing import Any

import pytest
from playwright.sync_api import Page

OPEN = """
    const { Drafts } = await import('/page/drafts.js');
    const { History } = await import('/page/history.js');
    const { replaceValue } = await import('/page/documents.js');
    const makeDrafts = (tab = { id: 't', isLive: async () => false }, hasKey = () => false) => (
        new Drafts(tab, hasKey, () => false));
    const drafts = makeDrafts();
    const net = (n) => ({ net: Array.from({ length: n }, (_, i) => [i, 2 * i, 0.5]) });
    const about = { title: 'A', description: '', origin: '' };
    const start = (id, surface) => ({ id, about, history: new History(surface), isPrivate: false });
    const edit = (session, z) => {
        session.history.keep(replaceValue(session.history.present, ['net', 1, 2], z));
    };
    const read = async (id) => (await drafts.device.read(id)).texts;
"""
"""Begins a script: an object of drafts, and functions that make and edit sessions."""


@pytest.fixture
def page(modules: Page) -> Iterator[Page]:
    """A page that may import modules, without any draft."""
    yield modules
    modules.evaluate(
        f"""async () => {{ {OPEN}
            await drafts.forgetAll();
            drafts.device.database?.close();
            drafts.channel.close();
            sessionStorage.clear();
        }}"""
    )


def run(page: Page, script: str) -> Any:
    """The result of a script after `OPEN`."""
    return page.evaluate(f"async () => {{ {OPEN} {script} }}")


def test_the_changes_from_one_document_to_another_make_it_again(page: Page) -> None:
    """Random edits of random trees; a change of a net is as small as the edit."""
    *sizes, size_of_column, unchanged = page.evaluate(
        """async () => {
            const { applyChanges, listChanges } = await import('/page/changes.js');
            let seed = 1;
            const random = (n) => {
                seed = (seed * 48271) % 2147483647;
                return seed % n;
            };
            const keys = ['a', 'b', 'weights', 'x/y', '0'];
            const tree = (depth) => {
                const kind = depth === 0 ? 2 : random(4);
                if (kind === 0) return Array.from({ length: random(5) }, () => tree(depth - 1));
                if (kind === 1) {
                    return Object.fromEntries(keys.filter(() => random(2)).map((key) => (
                        [key, tree(depth - 1)])));
                }
                return [null, true, 0, 1.5, -3, 'a', '', [], {}][random(9)];
            };
            const mutate = (value, depth) => {
                if (random(4) === 0) return tree(depth);
                if (Array.isArray(value)) {
                    const items = value.map((item) => (random(3) ? item : mutate(item, depth - 1)));
                    if (random(3) === 0) items.splice(random(items.length + 1), random(2), tree(1));
                    return items;
                }
                if (value === null || typeof value !== 'object') return value;
                return Object.fromEntries(Object.entries(value).map(([key, item]) => (
                    [key, random(3) ? item : mutate(item, depth - 1)])));
            };
            const text = (value) => JSON.stringify(value, (_, item) => (
                item !== null && typeof item === 'object' && !Array.isArray(item)
                    ? Object.fromEntries(Object.entries(item).sort()) : item));
            let wrong = 0;
            for (let i = 0; i < 2000; i += 1) {
                const from = { root: tree(4) };
                const to = { root: mutate(from.root, 4) };
                const changes = JSON.parse(JSON.stringify(listChanges(from, to)));
                const before = text(from);
                const made = applyChanges(from, changes);
                if (text(made) !== text(to) || text(from) !== before) wrong += 1;
            }
            const hundred = { length: 100 };
            const net = Array.from(hundred, () => Array.from(hundred, () => [1, 2, 3]));
            const row = net.map((items, i) => (i === 40 ? items.with(7, [1, 2, 4]) : items));
            const size = (to) => JSON.stringify(listChanges(net, to)).length;
            return [
                wrong,
                size(row),
                size(net.toSpliced(50, 1)),
                size(net.map((items) => items.slice(1))),
                listChanges(net, JSON.parse(JSON.stringify(net))).length,
            ];
        }"""
    )
    assert sizes == [0, 14, 14]
    assert unchanged == 0
    assert size_of_column < 2000  # of a net of 79 kB


def test_an_edit_writes_its_own_step_not_the_document(page: Page) -> None:
    result = run(
        page,
        """
        const session = start('one', net(5000));
        const written = [];
        const { write } = drafts.device;
        drafts.device.write = function (record, added, dropped) {
            const sizes = [...added.values()].map((text) => text.length);
            written.push([[...added.keys()], Math.max(...sizes) > 1000, dropped]);
            return write.call(this, record, added, dropped);
        };
        edit(session, 7);
        const places = [await drafts.save(session)];
        edit(session, 8);
        places.push(await drafts.save(session));
        session.history.undo();
        edit(session, 9);
        places.push(await drafts.save(session));
        const again = await makeDrafts().open('one', 'copy');
        const z = () => again.history.present.net[1][2];
        const zs = [z()];
        again.history.undo();
        zs.push(z());
        again.history.undo();
        zs.push(z(), again.history.present === again.history.first);
        return [written, places, zs, [...(await read('one')).keys()]];
        """,
    )
    written, places, zs, numbers = result
    # The first save writes the document, the step to the oldest document, and the first edit.
    assert written == [[[0, 1, 2], True, []], [[3], False, []], [[4], False, [3]]]
    assert places == ["device"] * 3
    assert zs == [9, 7, 0.5, True]
    assert numbers == [0, 1, 2, 4]


def test_the_last_twenty_surfaces_are_kept_and_no_more_than_there_is_room_for(page: Page) -> None:
    result = run(
        page,
        """
        const ids = async () => (await drafts.list()).map(({ id }) => id);
        let now = 1e12;
        Date.now = () => (now += 1000);
        for (let i = 0; i < 25; i += 1) {
            const session = start(`s${i}`, net(20));
            edit(session, i);
            await drafts.save(session);
        }
        const twenty = await ids();
        const { bytes } = (await drafts.list())[0];
        drafts.device.maxBytes = 5.5 * bytes;
        const last = start('last', net(20));
        edit(last, 3);
        await drafts.save(last);
        const five = await ids();
        const textsOfRemoved = (await drafts.device.read('s10')) === null;
        // One surface with a long history keeps the newest steps, and pushes the others out.
        for (let z = 1; z < 200; z += 1) edit(last, z + 0.123456789);
        const place = await drafts.save(last);
        const [record] = await drafts.list();
        const { history } = await makeDrafts().open('last', 'copy');
        const kept = [history.past.length, history.present.net[1][2], history.first.net[1][2]];
        // A surface that is larger than all the room is not kept.
        const tooLarge = await drafts.save(start('large', net(1000)));
        const share = record.bytes / bytes;
        return [twenty, five, textsOfRemoved, place, share, kept, tooLarge, await ids()];
        """,
    )
    twenty, five, is_removed, place, share, kept, too_large, ids = result
    assert twenty == [f"s{i}" for i in range(24, 4, -1)]
    assert five == ["last", "s24", "s23", "s22", "s21"]
    assert is_removed
    assert place == "device"
    assert share <= 5.5
    assert 20 <= kept[0] < 199
    assert kept[1:] == [199.123456789, 0.5]
    assert too_large == "nowhere"
    assert ids[0] == "last"


def test_if_the_browser_has_no_room_the_oldest_drafts_go_and_then_the_oldest_steps(
    page: Page,
) -> None:
    """The store of the test accepts 4000 bytes in all, as a browser with a small disk."""
    result = run(
        page,
        """
        const sizes = new Map();
        const { write, remove } = drafts.device;
        drafts.device.write = function (record, added, dropped) {
            const others = [...sizes].filter(([id]) => id !== record.id);
            const sum = others.reduce((total, [, size]) => total + size, record.bytes);
            if (sum > 4000) throw new DOMException('full', 'QuotaExceededError');
            sizes.set(record.id, record.bytes);
            return write.call(this, record, added, dropped);
        };
        drafts.device.remove = function (ids) {
            ids.forEach((id) => sizes.delete(id));
            return remove.call(this, ids);
        };
        const places = [];
        for (let i = 0; i < 8; i += 1) {
            const session = start(`s${i}`, net(50));
            edit(session, i);
            places.push(await drafts.save(session));
        }
        const session = start('long', net(50));
        for (let z = 0; z < 200; z += 1) {
            edit(session, z + 0.123456789);
        }
        places.push(await drafts.save(session));
        const { history } = await makeDrafts().open('long', 'copy');
        const huge = await drafts.save(start('huge', net(5000)));
        return [new Set(places).size, history.past.length, history.present.net[1][2], huge];
        """,
    )
    assert result[0] == 1
    assert 10 <= result[1] < 200
    assert result[2:] == [199.123456789, "nowhere"]


def test_a_damaged_draft_is_as_none_and_one_of_another_tab_is_copied(page: Page) -> None:
    result = run(
        page,
        """
        const session = start('one', net(3));
        edit(session, 7);
        edit(session, 8);
        await drafts.save(session);
        const busy = makeDrafts({ id: 'u', isLive: async (id) => id === 't' });
        const copy = await busy.open('one', 'copy');
        edit(copy, 9);
        await busy.save(copy);
        const taken = await makeDrafts({ id: 'v', isLive: async () => false }).open('one', 'no');
        const ids = (await drafts.list()).map(({ id, tab }) => id + tab).sort();
        // Another tab forgets all drafts: the next edit writes the whole draft again.
        await busy.forgetAll();
        await new Promise((resolve) => setTimeout(resolve, 100));
        edit(session, 10);
        await drafts.save(session);
        const again = await makeDrafts().open('one', 'copy');
        const { device } = drafts;
        const { record, texts } = await device.read('one');
        const opened = [];
        for (const damage of ['', '[[["net", 1, 2, 3], 3, 4]]', '{', '7']) {
            await device.write(record, new Map([[record.steps[1], damage]]), []);
            opened.push(await drafts.open('one', 'copy'));
        }
        await device.write({ ...record, position: 99 }, texts, []);
        opened.push(await drafts.open('one', 'copy'), await drafts.open('none', 'copy'));
        return [copy.id, taken.id, ids, again.history.past.length, opened.map((s) => s === null)];
        """,
    )
    copy_id, taken_id, ids, steps, are_none = result
    assert [copy_id, taken_id] == ["copy", "one"]
    assert ids == ["copyu", "onet"]
    assert steps == 3
    assert are_none == [True] * 6


def test_a_tab_without_locks_keeps_its_id_after_a_reload_and_not_in_a_duplicate(
    page: Page,
) -> None:
    """Browsers have locks in secure contexts only (https)."""
    result = page.evaluate(
        """async () => {
            const { Tab } = await import('/page/tab.js');
            Object.defineProperty(navigator, 'locks', { value: undefined, configurable: true });
            const first = new Tab();
            const { id } = first;
            dispatchEvent(new PageTransitionEvent('pagehide'));
            const reloaded = new Tab();
            await reloaded.claim();
            const duplicate = new Tab();
            await duplicate.claim();
            const live = [await duplicate.isLive(id), await duplicate.isLive(duplicate.id)];
            delete navigator.locks;
            return [reloaded.id === id, duplicate.id === id, live];
        }"""
    )
    assert result == [True, False, [True, False]]
