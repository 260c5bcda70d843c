"""Loading: coarse levels first, nothing from outside, and one readable message where something is wrong."""

import pytest
from fixtures.browser import served
from fixtures.bundles import Ground
from playwright.sync_api import Error


def test_no_request_leaves_the_page_and_nothing_is_complained_about(visit, plain):
    seen = visit(160, 100)
    asked, complaints = [], []
    seen.page.on("request", lambda request: asked.append(request.url))
    seen.page.on("console", lambda m: complaints.append(m.text) if m.type == "error" else None)
    seen.page.on("pageerror", lambda error: complaints.append(str(error)))
    seen.open(plain)
    assert complaints == []
    assert {url.startswith((plain, "data:")) for url in asked} == {True}
    assert len(asked) > 32


def test_chunks_are_read_the_coarsest_level_first_and_told_in_bytes(modules):
    queue, told, asked = modules.evaluate(
        """async () => {
          const { initialChunks, readChunks, readManifest } = await import("./data/bundle.js");
          const { webSource } = await import("./data/source.js");
          const source = webSource(new URL("./", location.href)), queue = initialChunks(await readManifest(source));
          const told = [], asked = [], read = (file, ...rest) => (asked.push(file), source.read(file, ...rest));
          await readChunks(queue, { read }, { take: () => {}, onProgress: progress => told.push({ ...progress }) });
          return [queue.map(({ tile, entry }) => [entry.level, tile, entry.file, entry.bytes]), told, asked];
        }"""
    )
    assert [(level, tile) for level, tile, *_ in queue] == [(level, tile) for level in (1, 0) for tile in range(16)]
    assert asked == [file for _, _, file, _ in queue]
    total = sum(size for *_, size in queue)
    assert told[-1] == {"bytes": total, "total": total, "chunks": 32, "of": 32}
    assert [one["bytes"] for one in told] == sorted(one["bytes"] for one in told)


def test_the_first_failure_ends_all_reading_and_is_thrown(modules):
    message, asked = modules.evaluate(
        """async () => {
          const { readChunks } = await import("./data/bundle.js");
          let asked = 0;
          const read = async () => {
            if (++asked === 3) throw new Error("the third");
            await new Promise(done => setTimeout(done, 5));
            return new ArrayBuffer(0);
          };
          const entry = { file: "x", bytes: 0, count: 0, orders: [] };
          const queue = Array.from({ length: 90 }, (_, tile) => ({ tile, entry }));
          const said = await readChunks(queue, { read }, { take: () => {} }).catch(error => error.message);
          return [said, asked];
        }"""
    )
    assert message == "the third" and asked <= 12


@pytest.mark.slow
@pytest.mark.parametrize(
    "spoil, message",
    [
        (lambda f: (f / "chunks/lod0_tile_02.bin").unlink(), "lod0_tile_02.bin is not there"),
        (lambda f: (f / "davgswt.json").unlink(), "davgswt.json is not there (the server answered 404)"),
    ],
    ids=["no chunk", "no manifest"],
)
def test_a_spoilt_bundle_is_named_with_what_to_do(visit, page_of, spoil, message):
    folder = page_of(Ground(discs=4))
    with served(folder) as address:
        spoil(folder)
        assert_said(visit(480, 300), address, message)


@pytest.mark.slow
def test_a_browser_without_webgl2_is_told(visit, plain):
    seen = visit(480, 300)
    seen.page.add_init_script("HTMLCanvasElement.prototype.getContext = () => null")
    assert_said(seen, plain, "no WebGL2")


def assert_said(seen, address, message):
    """The page shows one message as an alert, nothing is left spinning, and `ready` is rejected."""
    seen.open(address, wait=False)
    alert = seen.page.get_by_role("alert")
    alert.wait_for(state="visible")
    assert message in alert.inner_text()
    assert not seen.page.locator("#loading").is_visible()
    assert seen.page.evaluate("davgswt.ready.then(() => 'ready', () => 'refused')") == "refused"


PHOTOS = [{"round": int(k > 2), "at": [k - 2.0, 1.0, 3.0], "look": [0.5, -0.5], "picture": k} for k in range(5)]
ROUNDS = [{"photos": 3, "psnr": 27.1}, {"photos": 2, "psnr": None}]
VALUE = dict(unit="metre", half=2.0, photos=PHOTOS, rounds=ROUNDS, thumb=120, columns=8, pictures=5)


@pytest.mark.parametrize(
    "change, sound",
    [
        ({"more": 1}, True),
        ({"unit": 3}, False),
        ({"half": 0}, False),
        ({"thumb": 0}, False),
        ({"columns": 65}, False),
        ({"photos": 3}, False),
        ({"photos": [{"round": 0, "at": ["1", 2, 3], "look": [0, 0]}]}, False),
        ({"photos": [{"round": 0, "at": [1, 2, 3], "look": [0]}]}, False),
        ({"photos": [PHOTOS[0] | {"picture": 5}]}, False),
        ({"rounds": [{"photos": -1, "psnr": 1}]}, False),
        ({"rounds": [{"photos": 1, "psnr": "1"}]}, False),
    ],
)
def test_a_story_is_read_or_refused(call, change, sound):
    if sound:
        assert call("ui/story.js", "readStory", VALUE | change) == VALUE
    else:
        with pytest.raises(Error, match="story.json is not as the workflow writes it"):
            call("ui/story.js", "readStory", VALUE | change)
