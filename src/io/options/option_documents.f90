! SPDX-License-Identifier: MIT
!> The table of options for readers: as a Markdown table, as help on one group, and as a JSON Schema.
module rockdda_io_option_documents
   use rockdda_base_kinds, only : wp
   use rockdda_base_strings, only : to_string
   use rockdda_lines_statistics_options, only : all_statistics
   use rockdda_model_option, only : option_type, option_kind, list_rule, choice, columns_of, n_choices, &
      name_length
   use rockdda_model_option_rows, only : option_rows_type
   use rockdda_model_option_table, only : all_options
   use rockdda_model_options, only : dda_windows, is_set
   use rockdda_io_name_hints, only : other_words, other_words_for
   use rockdda_base_suggest, only : did_you_mean
   implicit none
   private
   public :: options_markdown, options_schema, group_help, groups_help, named_option_help, group_names, group_suggestion

   character(len=*), parameter :: nl = new_line('a')

   !> Words that users try for what stands in other files, where no group of joint statistics has this name.
   character(len=*), parameter :: in_geometry(4) = [character(len=15) :: 'hole', 'hole_point', 'fixed_point', &
                                                    'measured_point']

contains

   !> One row for each option.
   function options_markdown() result(text)
      character(len=:), allocatable :: text
      type(option_rows_type) :: list
      character(len=:), allocatable :: group
      integer :: i, k
      list = all_options()
      text = '| group | name | value | unit | default | meaning |'//nl//'|---|---|---|---|---|---|'//nl
      do i = 1, list%n_groups
         group = '`&'//trim(list%groups(i)%name)//'`'
         if (list%groups(i)%is_list) group = group//' (repeated)'
         do k = 1, list%n
            if (list%rows(k)%group /= i) cycle
            associate (row => list%rows(k))
               text = text//'| '//group//' | `'//row%name//'` | '//value_text(row)//' | '//row%unit//' | '// &
                      default_text(row)//' | '//meaning_text(row)//' |'//nl
            end associate
            group = ''
         end do
      end do
   end function options_markdown

   !> The options of the groups of this name as plain text, of a model and of joint statistics; '' when there is none.
   function group_help(name) result(text)
      character(len=*), intent(in) :: name       !! without '&'
      character(len=:), allocatable :: text
      type(option_rows_type) :: tables(2)
      integer :: i, j, k
      tables(1) = all_options()
      tables(2) = all_statistics()
      text = ''
      do j = 1, 2
         associate (list => tables(j))
            do i = 1, list%n_groups
               if (list%groups(i)%name /= name) cycle
               if (len(text) > 0) text = text//nl//nl
               text = text//'&'//name//in_file(j)//': '//list%groups(i)%meaning
               if (list%groups(i)%is_list) text = text//' One group for each.'
               do k = 1, list%n
                  if (list%rows(k)%group == i) text = text//nl//nl//option_help(list%rows(k))
               end do
            end do
         end associate
      end do
   end function group_help

   !> Where the groups of table j stand, unless it is the model.
   pure function in_file(j) result(text)
      integer, intent(in) :: j
      character(len=:), allocatable :: text
      text = ''
      if (j == 2) text = ' in a file of joint statistics (.dl)'
   end function in_file

   !> The options of this name of all groups as plain text; '' when there is none.
   function named_option_help(name) result(text)
      character(len=*), intent(in) :: name
      character(len=:), allocatable :: text
      type(option_rows_type) :: tables(2)
      character(len=:), allocatable :: groups, group
      integer :: i, j
      tables(1) = all_options()
      tables(2) = all_statistics()
      text = ''
      groups = ''
      do j = 1, 2
         do i = 1, tables(j)%n
            associate (row => tables(j)%rows(i))
               if (row%name /= name) cycle
               group = trim(tables(j)%groups(row%group)%name)
               if (len(text) > 0) text = text//nl//nl
               text = text//name//', an option of &'//group//in_file(j)//':'//nl//nl//option_help(row)
               group = "'rockdda help "//group//"'"
               if (index(groups, group) > 0) cycle
               if (len(groups) > 0) groups = groups//', '
               groups = groups//group
            end associate
         end do
      end do
      if (len(text) > 0) text = text//nl//nl//'All options of the group: '//groups//'.'
   end function named_option_help

   !> An option in plain text: name, value and unit in one line, then its meaning and its default.
   pure function option_help(row) result(text)
      type(option_type), intent(in) :: row
      character(len=:), allocatable :: text, plain
      integer :: i
      text = '  '//row%name//' = '
      plain = value_text(row)
      do i = 1, len(plain)
         if (plain(i:i) /= '`') text = text//plain(i:i)
      end do
      if (len(row%unit) > 0) text = text//' ['//row%unit//']'
      text = text//nl//'      '//row%meaning
      if (len(row%applies) > 0) text = text//' ('//row%applies//')'
      if (row%required) then
         text = text//nl//'      required'
      else
         text = text//nl//'      default: '//default_text(row)
      end if
   end function option_help

   !> The groups, a line each with the first sentence of their meaning.
   function groups_help() result(text)
      character(len=:), allocatable :: text
      text = 'groups of a labelled file or an options file:'//lines_of(all_options())//nl//nl// &
             'groups of a file of joint statistics (.dl):'//lines_of(all_statistics())//nl//nl// &
             "'rockdda help GROUP' lists the options of a group."
   end function groups_help

   !> A line for each group.
   pure function lines_of(list) result(text)
      type(option_rows_type), intent(in) :: list
      character(len=:), allocatable :: text
      integer :: i
      text = ''
      do i = 1, list%n_groups
         associate (meaning => list%groups(i)%meaning)
            text = text//nl//'  &'//list%groups(i)%name//' '//meaning(:index(meaning, '.'))
         end associate
      end do
   end function lines_of

   !> The names of all groups, a blank before each.
   function group_names() result(text)
      character(len=:), allocatable :: text
      character(len=name_length), allocatable :: names(:)
      type(option_rows_type) :: list, statistics
      integer :: i
      list = all_options()
      statistics = all_statistics()
      names = [character(len=name_length) :: list%group_names(), statistics%group_names()]
      text = ''
      do i = 1, size(names)
         if (all(names(1:i - 1) /= names(i))) text = text//' '//trim(names(i))
      end do
   end function group_names

   !> "; did you mean …?" with the nearest name of a group, of an option or of these words.
   function group_suggestion(name, words) result(text)
      character(len=*), intent(in) :: name, words(:)
      character(len=:), allocatable :: text
      type(option_rows_type) :: list, statistics
      character(len=name_length), allocatable :: known(:)
      if (any(in_geometry == name)) then
         text = '; lines and points stand in the geometry file: docs/file-formats.md'
         return
      end if
      list = all_options()
      statistics = all_statistics()
      known = [character(len=name_length) :: words, list%group_names(), list%names(), statistics%group_names(), &
               statistics%names()]
      text = other_words(name, known)
      if (len(text) == 0) text = did_you_mean(name, known)
   end function group_suggestion

   !> What may stand behind the equals sign.
   pure function value_text(row) result(text)
      type(option_type), intent(in) :: row
      character(len=:), allocatable :: text
      integer :: i
      select case (row%kind)
      case (option_kind%number); text = bounds_text(row)
      case (option_kind%whole); text = trim('whole '//bounds_text(row))
      case (option_kind%logical); text = 'logical'
      case (option_kind%text)
         text = trim(merge('file', 'text', row%is_file))
         if (row%or_number) text = 'whole ≥ 1 or text'
         if (row%or_number .and. len(row%unit) > 0) text = 'number or text'
      case (option_kind%choice)
         text = ''
         do i = 1, n_choices(row)
            if (i > 1) text = text//', '
            text = text//"`'"//choice(row, i)//"'`"
         end do
      case (option_kind%numbers); text = row%columns
      case (option_kind%list)
         text = 'numbers'
         if (row%rule == list_rule%pair) text = row%columns
      case (option_kind%wholes); text = trim('whole numbers '//bounds_text(row))
      case (option_kind%rows); text = row%columns//', …'
      case (option_kind%file, option_kind%record); text = 'file'
      end select
      if (len(text) == 0) text = 'number'
   end function value_text

   !> "> 0", "0 … 1", "[0, 90)".
   pure function bounds_text(row) result(text)
      type(option_type), intent(in) :: row
      character(len=:), allocatable :: text
      logical :: has_least, has_most
      has_least = row%least > -huge(1.0_wp)
      has_most = row%most < huge(1.0_wp)
      if (has_least .and. has_most) then
         text = merge('(', '[', row%above)//to_string(row%least)//', '//to_string(row%most)//merge(')', ']', row%below)
      else if (has_least) then
         text = '≥ '//to_string(row%least)
         if (row%above) text = '> '//to_string(row%least)
      else
         text = ''
      end if
   end function bounds_text

   !> What holds when the option is not given.
   pure function default_text(row) result(text)
      type(option_type), intent(in) :: row
      character(len=:), allocatable :: text
      if (row%required) then
         text = 'required'
      else if (len(row%default_text) > 0) then
         text = row%default_text
      else if (row%in_analysis) then
         text = "the analysis file's"
      else if (len(row%default_word) > 0) then
         text = row%default_word
         if (len(row%preset_word) > 0 .and. row%preset_word /= row%default_word) &
            text = text//' (preset '//dda_windows//': '//row%preset_word//')'
      else if (row%kind == option_kind%logical) then
         text = trim(merge('.true. ', '.false.', row%given%flag))
      else if (is_set(row%default)) then
         text = to_string(row%default)
         if (is_set(row%preset_default)) text = text//' (preset '//dda_windows//': '// &
                                                to_string(row%preset_default)//')'
      else
         text = 'none'
      end if
   end function default_text

   !> Meaning, where the option applies, and the page that says more.
   pure function meaning_text(row) result(text)
      type(option_type), intent(in) :: row
      character(len=:), allocatable :: text
      text = row%meaning
      if (len(row%applies) > 0) text = text//' ('//row%applies//')'
      if (len(row%see) > 0) text = text//' ([more]('//row%see//'))'
   end function meaning_text

   !> A JSON Schema (draft 2020-12) of options as Python has them: an object of groups; a group that is repeated is a
   !> list of objects.
   function options_schema() result(text)
      character(len=:), allocatable :: text
      type(option_rows_type) :: list
      character(len=:), allocatable :: name, rows, required, comma
      integer :: i, k
      list = all_options()
      text = '{'//nl//'  "$schema": "https://json-schema.org/draft/2020-12/schema",'//nl// &
             '  "title": "RockDDA run options",'//nl//'  "type": "object",'//nl// &
             '  "additionalProperties": false,'//nl//'  "properties": {'//nl
      do i = 1, list%n_groups
         name = trim(list%groups(i)%name)
         text = text//'    "'//name//'": {"anyOf": [{"$ref": "#/$defs/'//name// &
                '"}, {"type": "array", "items": {"$ref": "#/$defs/'//name//'"}}]}'//trim(merge(', ', '  ', &
                i < list%n_groups))//nl
      end do
      text = text//'  },'//nl//'  "$defs": {'//nl
      do i = 1, list%n_groups
         rows = ''
         required = ''
         comma = ''
         do k = 1, list%n
            if (list%rows(k)%group /= i) cycle
            associate (row => list%rows(k))
               if (len(rows) > 0) rows = rows//','//nl
               rows = rows//'        "'//row%name//'": {'//schema_of(row)//'}'
               if (row%required) then
                  required = required//comma//'"'//row%name//'"'
                  comma = ', '
               end if
            end associate
         end do
         text = text//'    "'//trim(list%groups(i)%name)//'": {'//nl//'      "description": "'// &
                list%groups(i)%meaning//'",'//nl//other_words_of(list%groups(i)%name, '      ', ','//nl)
         if (list%groups(i)%is_list) text = text//'      "x-list": true,'//nl
         text = text//'      "type": "object",'//nl//'      "additionalProperties": false,'//nl
         if (len(required) > 0) text = text//'      "required": ['//required//'],'//nl
         text = text//'      "properties": {'//nl//rows//nl//'      }'//nl//'    }'// &
                trim(merge(', ', '  ', i < list%n_groups))//nl
      end do
      text = text//'  }'//nl//'}'//nl
   end function options_schema

   !> '"x-other-words": "phi fi"': what users write for a name; '' without any.
   pure function other_words_of(name, before, behind) result(text)
      character(len=*), intent(in) :: name, before, behind
      character(len=:), allocatable :: text
      text = other_words_for(name)
      if (len(text) > 0) text = before//'"x-other-words": "'//text//'"'//behind
   end function other_words_of

   !> Members of the schema of one option.
   pure function schema_of(row) result(text)
      type(option_type), intent(in) :: row
      character(len=:), allocatable :: text
      integer :: i
      text = '"description": "'//row%meaning//'"'
      if (len(row%unit) > 0) text = text//', "x-unit": "'//row%unit//'"'
      if (len(row%applies) > 0) text = text//', "x-applies-to": "'//row%applies//'"'
      if (.not. row%required) text = text//', "x-default": "'//default_text(row)//'"'
      if (len(row%columns) > 0) text = text//', "x-columns": "'//row%columns//'"'
      text = text//other_words_of(row%name, ', ', '')
      if (row%adds_up) text = text//', "x-adds-up": true'
      text = text//', '
      select case (row%kind)
      case (option_kind%number); text = text//'"type": "number"'//schema_bounds(row)
      case (option_kind%whole); text = text//'"type": "integer"'//schema_bounds(row)
      case (option_kind%logical); text = text//'"type": "boolean"'
      case (option_kind%text)
         if (row%or_number .and. len(row%unit) > 0) then
            text = text//'"type": ["number", "string"]'
         else if (row%or_number) then
            text = text//'"type": ["integer", "string"], "minimum": 1'
         else
            text = text//'"type": "string"'
         end if
         if (row%not_blank) text = text//', "minLength": 1'
      case (option_kind%choice)
         text = text//'"type": "string", "enum": ['
         do i = 1, n_choices(row)
            if (i > 1) text = text//', '
            text = text//'"'//choice(row, i)//'"'
         end do
         if (len(row%old_choice) > 0) text = text//', "'//row%old_choice//'"'
         text = text//']'
      case (option_kind%numbers); text = text//'"type": "array", "items": {"type": "number"}, "minItems": '// &
                to_string(size(row%given%numbers))//', "maxItems": '//to_string(size(row%given%numbers))
      case (option_kind%list)
         if (row%rule == list_rule%pair) then
            text = text//'"type": "array", "items": {"type": "number"}, "minItems": 2, "maxItems": 2'
         else
            text = text//'"type": ["number", "array"], "items": {"type": "number"}'
         end if
      case (option_kind%wholes); text = text//'"type": ["integer", "array"]'//schema_bounds(row)// &
                ', "items": {"type": "integer"'//schema_bounds(row)//'}'
      case (option_kind%rows); text = text//'"type": "array", "items": {"type": "number"}, "minItems": '// &
                to_string(size(columns_of(row)) - merge(1, 0, row%rule == list_rule%or_constant))
      case (option_kind%file, option_kind%record); text = text//'"type": "string", "x-file": true'
      end select
      if (row%kind == option_kind%logical) text = text//', "default": '// &
                                              trim(merge('true ', 'false', row%given%flag))
      if (len(row%default_word) > 0) text = text//', "default": "'//row%default_word//'"'
      if (is_set(row%default)) text = text//', "default": '//to_string(row%default, 10)
   end function schema_of

   !> Bounds in a schema.
   pure function schema_bounds(row) result(text)
      type(option_type), intent(in) :: row
      character(len=:), allocatable :: text
      text = ''
      if (row%least > -huge(1.0_wp)) text = ', "'//trim(merge('exclusiveMinimum', 'minimum         ', row%above))// &
                                            '": '//to_string(row%least)
      if (row%most < huge(1.0_wp)) text = text//', "'//trim(merge('exclusiveMaximum', 'maximum         ', &
                                                                  row%below))//'": '//to_string(row%most)
   end function schema_bounds

end module rockdda_io_option_documents
