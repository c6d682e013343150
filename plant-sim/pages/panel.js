// What a person can ask for: drawn from what the server offers, and nothing else.

/** Time between two holds of a button that is pressed; the controller goes on for 150 ms after each. */
const HOLD_MS = 50;

class Panel {
    /** @param onAnswer is called with a sentence when the server does not take what was asked for, and with nothing when it does */
    constructor(offers, onAnswer) {
        this.onAnswer = onAnswer;
        this.values = new Map();
        this.buttons = [];
        this.urgent = [];
        this.groups = offers.map((group) => this.group(group));
    }

    /** Whether something can be asked for now. */
    enable(on) {
        [...this.buttons, ...this.urgent].forEach((button) => (button.disabled = !on));
    }

    group({ title, hint, fields, buttons }) {
        const controls = fields.flatMap((field) => this.field(field));
        const made = buttons.map((offer) => this.button(offer)).filter((button) => button !== null);
        const bar = element("div", { class: made.length > 6 ? "bar many" : "bar" }, ...made);
        return element("section", { "aria-label": title }, element("h2", {}, title), hint ? element("p", { class: "hint always" }, hint) : null, ...controls, bar);
    }

    /** A button; those that are urgent have a place of their own. */
    button({ label, ask: name, takes, with: fixed, urgent, held }) {
        const press = async () => this.onAnswer(await ask({ [name]: { ...fixed, ...Object.fromEntries(takes.map((key) => [key, this.values.get(key)()])) } }));
        const button = element("button", { type: "button", disabled: "", class: urgent ? `urgent ${name}` : null, ...(held ? {} : { click: press }) }, label);
        if (held) {
            this.hold(button, press);
        }
        (urgent ? this.urgent : this.buttons).push(button);
        return urgent ? null : button;
    }

    /** What is asked for goes on as long as the button is pressed, by pointer or key: it is held again and again, and then stopped. */
    hold(button, press) {
        let pressed = false;
        let going = false;
        const begin = async () => {
            if (going || button.disabled) {
                return;
            }
            going = pressed = true;
            await press();
            while (pressed) {
                ask({ hold: {} });
                await new Promise((later) => setTimeout(later, HOLD_MS));
            }
            await ask({ stop: {} });
            going = false;
        };
        const end = () => (pressed = false);
        const isPress = ({ key }) => key === "Enter" || key === " ";
        button.addEventListener("pointerdown", (event) => event.button === 0 && begin());
        button.addEventListener("keydown", (event) => isPress(event) && !event.repeat && begin());
        button.addEventListener("keyup", (event) => isPress(event) && end());
        ["pointerup", "pointerleave", "pointercancel", "blur"].forEach((name) => button.addEventListener(name, end));
        addEventListener("blur", end);
        document.addEventListener("visibilitychange", end);
    }

    field(field) {
        if (field.faults) {
            return this.fault(field);
        }
        const id = `set-${field.key}`;
        const input = field.choices
            ? element("select", { id }, ...field.choices.map((name) => element("option", { value: name }, name)))
            : element("input", { id, type: "number", min: field.least, max: field.greatest, step: field.step });
        input.value = field.start;
        this.values.set(field.key, () => (field.choices ? input.value : +input.value));
        return [line(field.label, input, field.unit ?? "")];
    }

    /** A fault: its place, its kind there, and its value where it takes one. */
    fault({ key, label, faults }) {
        const places = [...new Set(faults.map(({ place }) => place))];
        const place = element("select", { id: `set-${key}`, change: () => choose() }, ...places.map((name) => element("option", { value: name }, name.replace(":", " "))));
        const kind = element("select", { id: `set-${key}-kind`, change: () => describe() });
        const value = element("input", { id: `set-${key}-value`, type: "number", step: "any" });
        const unit = element("span", { class: "unit" });
        const about = element("p", { class: "hint always" });
        const row = element("div", { class: "control" }, element("label", { for: value.id }, "Value"), unit, value);
        const chosen = () => faults.find(({ place: where, text }) => where === place.value && text === kind.value);
        const describe = () => {
            const { value: number, about: words } = chosen();
            about.textContent = `${words[0].toUpperCase()}${words.slice(1)}.`;
            row.hidden = number === null;
            if (number) {
                Object.assign(value, { min: number.least, max: number.greatest, value: number.start });
                unit.textContent = `${number.least} to ${number.greatest} ${number.unit}`;
            }
        };
        const choose = () => {
            kind.replaceChildren(...faults.filter(({ place: where }) => where === place.value).map(({ text }) => element("option", { value: text }, text.slice(place.value.length + 1))));
            describe();
        };
        place.value = places.find((name) => name.startsWith("encoder")) ?? places[0];
        choose();
        this.values.set(key, () => (chosen().value ? `${kind.value}=${value.value}` : kind.value));
        return [line("Place", place, ""), line(label, kind, ""), about, row];
    }
}

/** A control with its label and unit. */
function line(label, control, unit) {
    return element("div", { class: "control short" }, element("label", { for: control.id }, label), control, element("span", { class: "unit" }, unit));
}
