-- From here on the same for every table of messages.

-- Lua 5.2 has bit32; Wireshark brings bit for what comes after it.
local bit = rawget(_G, "bit32") or rawget(_G, "bit") or require("bit")
local scara = Proto("scara", "SCARA drive cabinet")
local make = {
    u8 = ProtoField.uint8, u16 = ProtoField.uint16, u32 = ProtoField.uint32,
    i16 = ProtoField.int16, i32 = ProtoField.int32, f32 = ProtoField.float,
}
local size = { u8 = 1, u16 = 2, u32 = 4, i16 = 2, i32 = 4, f32 = 4 }

local fields = {}
for _, message in pairs(messages) do
    local prefix = "scara." .. message.name:lower() .. "."
    for _, signal in ipairs(message.signals) do
        local abbreviation = prefix .. signal.name
        if signal.bit then
            local width = 8 * size[signal.kind]
            signal.field = ProtoField.bool(abbreviation, signal.name, width, nil, bit.lshift(1, signal.bit))
        elseif signal.kind == "f32" or not signal.codes then
            signal.field = make[signal.kind](abbreviation, signal.name)
        else
            signal.field = ProtoField.uint8(abbreviation, signal.name, base.DEC, signal.codes)
        end
        table.insert(fields, signal.field)
    end
end
local counter = ProtoField.uint8("scara.counter", "counter")
local crc = ProtoField.uint16("scara.crc", "crc", base.HEX)
table.insert(fields, counter)
table.insert(fields, crc)
scara.fields = fields
local wrong_length = ProtoExpert.new("scara.wrong_length", "wrong length", expert.group.MALFORMED, expert.severity.ERROR)
local wrong_crc = ProtoExpert.new("scara.wrong_crc", "wrong CRC", expert.group.CHECKSUM, expert.severity.ERROR)
scara.experts = { wrong_length, wrong_crc }

local can_id = Field.new("can.id")

-- Bit by bit, most significant bit first, of the identifier (two bytes, big-endian) and of the bytes before the CRC.
local function checksum(id, tvb, length, width, polynomial, start, final)
    local top, mask = bit.lshift(1, width - 1), bit.lshift(1, width) - 1
    local value = start
    local function take(byte)
        value = bit.bxor(value, bit.lshift(byte, width - 8))
        for _ = 1, 8 do
            local carry = bit.band(value, top) ~= 0
            value = bit.band(bit.lshift(value, 1), mask)
            if carry then value = bit.bxor(value, polynomial) end
        end
    end
    take(bit.rshift(id, 8))
    take(bit.band(id, 0xFF))
    for at = 0, length - 1 do take(tvb(at, 1):uint()) end
    return bit.bxor(value, final)
end

local function protection(message, id, tvb, tree)
    local at = message.length - (message.fd and 3 or 2)
    if message.fd then
        tree:add(counter, tvb(at, 1))
        local item = tree:add(crc, tvb(at + 1, 2))
        if tvb(at + 1, 2):uint() ~= checksum(id, tvb, at + 1, 16, 0x1021, 0xFFFF, 0) then
            item:add_proto_expert_info(wrong_crc)
        end
    else
        tree:add(counter, tvb(at, 1), bit.band(tvb(at, 1):uint(), 0x0F))
        local item = tree:add(crc, tvb(at + 1, 1))
        if tvb(at + 1, 1):uint() ~= checksum(id, tvb, at + 1, 8, 0x2F, 0xFF, 0xFF) then
            item:add_proto_expert_info(wrong_crc)
        end
    end
end

function scara.dissector(tvb, pinfo, tree)
    local id = can_id().value
    local message = messages[id]
    pinfo.cols.protocol = "SCARA"
    pinfo.cols.info = message.name
    local subtree = tree:add(scara, tvb(), "SCARA " .. message.name)
    if tvb:len() == 0 and message.may_be_empty then
        return
    end
    if tvb:len() ~= message.length then
        subtree:add_proto_expert_info(wrong_length, tvb:len() .. " bytes, expected " .. message.length)
        return
    end
    local selected
    for _, signal in ipairs(message.signals) do
        local range = tvb(signal.at, size[signal.kind])
        if signal.selects then
            selected = range:le_uint()
            local name = signal.codes[selected]
            if name then
                pinfo.cols.info:append(" " .. name)
                subtree:append_text(" " .. name)
            end
        end
        if signal.tag == nil or signal.tag == selected then
            local item = subtree:add_le(signal.field, range)
            if signal.unit then item:append_text(" " .. signal.unit) end
        end
    end
    if message.protected then
        protection(message, id, tvb, subtree)
    end
end

local identifiers = DissectorTable.get("can.id")
for id in pairs(messages) do
    identifiers:add(id, scara)
end
